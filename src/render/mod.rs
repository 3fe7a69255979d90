//! One call for every renderer, for the window and the command alike.

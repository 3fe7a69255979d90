//! Writing `.vtu`.

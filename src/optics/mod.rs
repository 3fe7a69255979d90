//! From scalar to light: transfer-function lookup, splitting at knots, partial pre-integration.

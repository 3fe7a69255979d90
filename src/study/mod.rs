//! What runs the rest many times and reports: benchmarks.

//! The exact renderer: the mesh itself, ray by ray, in f64. The ground truth; it shares no code with what it judges.

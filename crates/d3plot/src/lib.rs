//! d3plot

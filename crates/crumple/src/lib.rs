//! crumple

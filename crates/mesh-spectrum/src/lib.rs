//! mesh-spectrum

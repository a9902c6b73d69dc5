//! Spectral system identification with any number of inputs and outputs.

//! Statistical tests over closures and numbers: chi-square, z-tests, confidence intervals.
#![forbid(unsafe_code)]

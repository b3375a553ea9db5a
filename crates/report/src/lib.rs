//! Figures and pages from run folders.
mod figure;

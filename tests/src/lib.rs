//! System tests across the crates.

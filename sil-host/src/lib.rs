//! Software-in-the-loop harness.

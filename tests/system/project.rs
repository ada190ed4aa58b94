//! The project's own text: which crate and which folder imports which.

mod law_imports;

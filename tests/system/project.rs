//! The project's own text: which crate and which folder imports which, which Rust it needs, and what its documents
//! name.

mod law_imports;
mod law_minimum_rust;
mod tool_documented_commands;
mod tool_documents;

//! The command line and the documents: results, files, refusals; what documents name.

mod tool_accuracy;
mod tool_command_line;
mod tool_documents;
mod tool_estimate;
mod tool_filters;
mod tool_results;

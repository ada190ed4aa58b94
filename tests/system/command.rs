//! The command line: results, files, refusals.

mod tool_accuracy;
mod tool_beside;
mod tool_cluster;
mod tool_command_line;
mod tool_compare;
mod tool_conventions;
mod tool_estimate;
mod tool_faults;
mod tool_filters;
mod tool_gallery;
mod tool_hostile_inputs;
mod tool_identify;
mod tool_import;
mod tool_logs;
mod tool_parts;
mod tool_python_module;
mod tool_reports;
mod tool_results;
mod tool_scene_files;
mod tool_simulate_models;
mod tool_stator;
mod tool_sweep;
mod tool_tilting_scenes;
mod tool_told;

//! One binary of system tests, in folders by subject.
//!
//! The prefix of a test says where its expected value comes from: `law_` a law of physics or a property, `exact_` a
//! closed form, `dual_` a second derivation, `tool_` what a command documents, `regress_` an earlier result.

mod support;

mod closed_loop;
mod command;
mod filters;
mod motor;
mod page;
mod project;

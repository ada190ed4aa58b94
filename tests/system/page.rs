//! The page, in a real browser.

mod tool_page;

//! Reports: one HTML file with zoomable plots, and static figures.

pub mod chart;
pub mod page;
mod picture;
pub mod simplify;
pub mod value;

pub use chart::{Chart, Line, Panel, Role, Window};
pub use page::{Block, Page, Table};

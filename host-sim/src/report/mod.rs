//! Reports: one HTML file with zoomable plots, and static figures.

pub mod bins;
pub mod chart;
pub mod page;
mod picture;
pub mod prediction;
pub mod simplify;
pub mod value;

pub use chart::{Chart, Line, Panel, Role, Window};
pub use page::{Block, Page, Table};

//! Reports: one HTML file with zoomable plots, and static figures.

pub mod chart;
pub mod page;
pub mod simplify;

pub use chart::{Chart, Line, Panel, Role, Window};
pub use page::{Block, Page, Table};

//! The plant behind the control core, and the bench engineer's tool.

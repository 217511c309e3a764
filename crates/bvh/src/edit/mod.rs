//! Operations that change a tree in place, one a file.

pub(crate) mod ascend;
pub(crate) mod depth;
pub(crate) mod graft;
pub(crate) mod insert;
pub(crate) mod insert_many;
pub(crate) mod move_leaf;
pub(crate) mod optimize;
pub(crate) mod refit;
pub(crate) mod remove;
pub(crate) mod rotate;

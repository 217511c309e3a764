//! Queries, one a file. All visit without allocation: the depth bound makes fixed stacks sufficient.

pub(crate) mod overlap;
pub(crate) mod ray;

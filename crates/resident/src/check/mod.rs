//! What is refused before anything is changed: batches that contradict themselves or what is resident, frames and
//! environments that cannot be rendered. Every backend asks here first.

mod batch;
mod frame;

pub use batch::{Resident, check_batch};
pub use frame::{check_environment, check_frame, check_view_with_scene};

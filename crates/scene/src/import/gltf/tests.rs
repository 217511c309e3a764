//! Small documents, one per feature and per refusal.

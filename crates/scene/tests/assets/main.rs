//! Third-party files: what they are refused for, that counts are those of their JSON, that every accessor decodes, and
//! that it decodes to what an independent reader sees. They are found through `ORTHANT_ASSETS`.

mod animation;
mod corpus;
mod counts;
mod export;
mod malformed;
mod obj;
mod peer;

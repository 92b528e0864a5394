//! The studio: a server on this computer alone, and a page where an axis is seen, dragged and fitted in a browser.
//!
//! `server` listens and ends, `guard` lets nobody else in, `socket` talks to a page, and the acts of `taut-acts` answer
//! it with what the library computes. The page is in `studio/page`: plain modules that hold no physics. `folder` has it
//! for hosts that serve files alone.

mod address;
mod assets;
mod folder;
mod guard;
mod keys;
mod pool;
mod server;
mod socket;
mod state;
mod upload;

pub use folder::page_without_server;
pub use server::{Options, serve};

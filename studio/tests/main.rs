//! The studio as a server: who is let in, what is refused, how it ends.

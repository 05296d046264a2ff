//! Recordings: round trips, files of other programs, damage, and independent readers.

mod damage;
mod drivers;
mod foreign;
mod formats;
mod killed;
mod las;
mod map;
mod points;
mod programs;
mod readers;
mod result;
mod round_trip;

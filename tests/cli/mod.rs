//! The commands: output, files and errors.

mod benchmark;
mod commands;
mod compare;
mod document_blocks;
mod documents;
mod edited;
mod examples;
mod gains;
mod hostile;
mod hosts;
mod info;
mod least;
mod live;
mod live_run;
mod maps;
mod numbers;
mod output;
mod ros2;
mod scene;
mod sensor_models;
mod specs;
mod summary;
mod terminal;

//! Renders whole scenes through the library and holds them to closed forms and to each other, on
//! every traversal that the device has. One binary, so that it links once.

mod accuracy;
mod blend;
mod cameras;
mod check;
mod closed_forms;
mod convergence;
mod environment;
mod estimators;
mod furnace;
mod guide;
mod instances;
mod khronos;
mod lamps;
mod limits;
mod optics;
mod partition;
mod repeatable;
mod rivals;
mod shapes;
mod showroom;
mod specialization;

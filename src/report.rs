//! Rollouts and metrics into tables, plots and one page, by Polars.

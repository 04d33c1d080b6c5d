#pragma once
/// The files of apps/report/assets, embedded at build time by cmake/embed.cmake.
#include <string_view>

namespace sparflow {

/// @param name path below apps/report/assets, e.g. "uplot/uPlot.min.css"
/// @return the file's bytes, valid as long as the program runs; empty when there is no such asset
std::string_view page_asset(std::string_view name);

}  // namespace sparflow

#pragma once

#include <memory>
#include <string>

#include "scanloc/core/map/map.hpp"

namespace scanloc::python {

/// A map in memory, and the file that it was read from.
struct PythonMap {
  std::shared_ptr<const Map> map;
  std::string path;
};

}  // namespace scanloc::python

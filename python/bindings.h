/** The parts of the Python module `forereach`. python/forereach/_forereach.pyi has the types of all that they bind. */
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <pybind11/pybind11.h>

#include "bus/process.h"

namespace forereach {

namespace py = pybind11;
namespace fs = std::filesystem;

void BindTask(py::module_& module);
void BindLog(py::module_& module);
void BindBus(py::module_& module);
void BindSupervisor(py::module_& module);

/** None for -1, as witnesses have it where they do not apply. */
[[nodiscard]] inline py::object IndexOrNone(std::int64_t index) {
  return index < 0 ? py::object(py::none()) : py::object(py::int_(index));
}

}  // namespace forereach

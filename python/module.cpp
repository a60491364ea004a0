#include <pybind11/pybind11.h>

#include <stdexcept>
#include <typeinfo>

#include "lcmtypes/bad_input.h"
#include "python/bindings.h"

namespace forereach {
namespace {

// Every error of ours is one class in Python. The text is the one line that the command prints.
void TranslateErrors(py::module_& module) {
  static py::exception<BadInput> error(module, "Error", PyExc_ValueError);
  error.attr("__doc__") = "What was given cannot be used. The text names the place, the value and the bound.";
  py::register_local_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const BadInput& bad) {
      error(bad.what());
    } catch (const std::invalid_argument& bad) {
      error(bad.what());
    } catch (const std::runtime_error& bad) {
      if (typeid(bad) != typeid(std::runtime_error)) throw;  // derived classes are pybind11's
      error(bad.what());
    }
  });
}

}  // namespace

PYBIND11_MODULE(_forereach, module) {
  module.doc() = "ForeReach: certifies planned control sequences before a robot executes them.";
  TranslateErrors(module);
  BindTask(module);
  BindLog(module);
  BindBus(module);
  BindSupervisor(module);
}

}  // namespace forereach

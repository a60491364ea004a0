/** How the clients of a bus wait in Python, and what they say without a key. */
#pragma once

#include <functional>

#include <pybind11/pybind11.h>

#include "bus/bus_options.h"

namespace forereach {

/** Waits without Python's lock; what handlers need of Python takes it. Ctrl-C ends the wait with Python's exception. */
inline void WithoutLock(const std::function<void()>& wait) {
  {
    const pybind11::gil_scoped_release release;
    wait();
  }
  if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
}

/** kUnsignedWarning as a UserWarning. */
inline void WarnUnless(bool is_signed) {
  if (!is_signed && PyErr_WarnEx(PyExc_UserWarning, kUnsignedWarning, 1) < 0) throw pybind11::error_already_set();
}

}  // namespace forereach

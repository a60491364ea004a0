/** NumPy arrays in and out. What comes in is copied: no other thread changes it while it is judged. */
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "forereach/sets/eigen.h"

namespace forereach {

namespace py = pybind11;

/** An array of float64 with its own numbers, in C order. @param shape as many entries as it has dimensions. */
[[nodiscard]] py::array_t<double> ArrayOf(const std::vector<double>& numbers, const std::vector<py::ssize_t>& shape);
[[nodiscard]] py::array_t<double> ArrayOf(const Eigen::MatrixXd& matrix);

/** The numbers of an array of real numbers, whatever their order in memory.
@param name of the argument. @param dimensions that it has to have.
@throws std::invalid_argument that names the argument, what it is and what it has to be: another number of dimensions,
no real numbers of at most 64 bits. Numbers that are not finite pass: they are judged. */
[[nodiscard]] py::array_t<double> NumbersOf(const py::handle& given, const std::string& name, int dimensions);

[[nodiscard]] Eigen::VectorXd VectorOf(const py::handle& given, const std::string& name);

/** The two arrays of `x0` or `data`. @throws std::invalid_argument if it is no pair. */
[[nodiscard]] std::pair<py::object, py::object> PairOf(const py::handle& given, const std::string& name = "x0");

/** (T, m) as m-by-T, a column a step: the layout of a Plan. */
[[nodiscard]] Eigen::MatrixXd ControlsOf(const py::handle& given);
/** (B, T, m), as many of them. */
[[nodiscard]] std::vector<Eigen::MatrixXd> ManyControlsOf(const py::handle& given);

}  // namespace forereach

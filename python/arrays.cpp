#include "python/arrays.h"

#include <algorithm>
#include <stdexcept>

namespace forereach {
namespace {

using NumpyOrder = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Eigen::MatrixXd Steps(const double* numbers, py::ssize_t steps, py::ssize_t inputs) {
  return Eigen::Map<const NumpyOrder>(numbers, steps, inputs).transpose();
}

}  // namespace

py::array_t<double> ArrayOf(const std::vector<double>& numbers, const std::vector<py::ssize_t>& shape) {
  py::array_t<double> array(shape);
  std::ranges::copy(numbers, array.mutable_data());
  return array;
}

py::array_t<double> ArrayOf(const Eigen::MatrixXd& matrix) {
  py::array_t<double> array({matrix.rows(), matrix.cols()});
  Eigen::Map<NumpyOrder>(array.mutable_data(), matrix.rows(), matrix.cols()) = matrix;
  return array;
}

py::array_t<double> NumbersOf(const py::handle& given, const std::string& name, int dimensions) {
  const py::array array = py::array::ensure(given);
  if (!array) {
    PyErr_Clear();
    throw std::invalid_argument(name + ": is no array");
  }
  const char kind = array.dtype().kind();
  if ((kind != 'f' && kind != 'i' && kind != 'u') || array.itemsize() > 8)
    throw std::invalid_argument(name + ": is of dtype " + py::str(array.dtype()).cast<std::string>() +
                                ", must be of real numbers of at most 64 bits");
  if (array.ndim() != dimensions)
    throw std::invalid_argument(name + ": has " + std::to_string(array.ndim()) + " dimensions, must have " +
                                std::to_string(dimensions));
  return py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(array);
}

Eigen::VectorXd VectorOf(const py::handle& given, const std::string& name) {
  const py::array_t<double> numbers = NumbersOf(given, name, 1);
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(), numbers.size());
}

std::pair<py::object, py::object> PairOf(const py::handle& given, const std::string& name) {
  if (!py::isinstance<py::sequence>(given) || py::len(given) != 2)
    throw std::invalid_argument(name + ": must be a pair " + (name == "x0" ? "(center, half_width)" : "(z, x_next)"));
  const auto pair = py::reinterpret_borrow<py::sequence>(given);
  return {pair[0], pair[1]};
}

Eigen::MatrixXd ControlsOf(const py::handle& given) {
  const py::array_t<double> numbers = NumbersOf(given, "U", 2);
  return Steps(numbers.data(), numbers.shape(0), numbers.shape(1));
}

std::vector<Eigen::MatrixXd> ManyControlsOf(const py::handle& given) {
  const py::array_t<double> numbers = NumbersOf(given, "Us", 3);
  const py::ssize_t steps = numbers.shape(1), inputs = numbers.shape(2);
  std::vector<Eigen::MatrixXd> all;
  for (py::ssize_t i = 0; i < numbers.shape(0); ++i)
    all.push_back(Steps(numbers.data() + i * steps * inputs, steps, inputs));
  return all;
}

}  // namespace forereach

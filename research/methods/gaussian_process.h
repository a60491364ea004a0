/** Gaussian-process bands: posterior mean +- k posterior standard deviations (Rasmussen & Williams 2006).

The paper gives only k = 2 and k = 3. The other settings are textbook defaults:
- one process for each coordinate k with columns in L, over the coordinates of z that L names; zero mean and unit
  variance after both z and r~ are scaled by mean and standard deviation of the sample;
- squared-exponential kernel with a length-scale for each coordinate, Eq. (5.1), and a noise variance;
- hyperparameters that maximise the log marginal likelihood, Eq. (5.8), by its gradient, Eq. (5.9), with 100 steps of
  Rprop (Blum & Riedmiller 2013) from unit length-scales, unit signal and noise 0.1; the noise stays above 1e-3, which
  is what keeps the matrix well conditioned on noiseless data;
- the band is that of the latent function, at the center of the hull of Z and, if asked, at its corners.
A coordinate that L declares constant has the hull of its observations. */
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "research/methods/method.h"

namespace forereach::research {

/** Regression of one output y on inputs X, N-by-a, both taken as they are. */
class GaussianProcess {
 public:
  struct Hyperparameters {
    Eigen::VectorXd length_scales;  ///< a entries
    double signal, noise;           ///< standard deviations
  };
  struct Prediction {
    double mean, deviation;  ///< of the latent function
  };

  /** @pre N >= 1, all hyperparameters positive. Cost O(N^3). */
  GaussianProcess(Eigen::MatrixXd inputs, Eigen::VectorXd outputs, Hyperparameters hyperparameters);

  /** Eqs. (2.25), (2.26) at one point, a entries. Cost O(N^2). */
  [[nodiscard]] Prediction Predict(const Eigen::VectorXd& point) const { return Predict(Eigen::MatrixXd(point))[0]; }
  /** The same at several points, the columns of an a-by-p matrix: one pass over the factor. */
  [[nodiscard]] std::vector<Prediction> Predict(const Eigen::MatrixXd& points) const;

  /** log p(y | X), Eq. (5.8). */
  [[nodiscard]] double LogMarginalLikelihood() const;

  /** Its gradient by the logarithms of (length-scales, signal, noise), Eq. (5.9). Cost O(N^3 + a N^2). */
  [[nodiscard]] Eigen::VectorXd LikelihoodGradient() const;

  [[nodiscard]] const Hyperparameters& hyperparameters() const { return hyperparameters_; }

 private:
  /** k(x_i, point) for every i; the point in length-scales. */
  [[nodiscard]] Eigen::VectorXd Kernel(const Eigen::VectorXd& scaled) const;

  Eigen::MatrixXd scaled_;  // inputs in length-scales
  Eigen::VectorXd outputs_;
  Hyperparameters hyperparameters_;
  Eigen::MatrixXd kernel_;  // without noise
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd weights_;  // (K + noise^2 I)^-1 y
};

/** The process of largest likelihood found. Cost: about a hundred O(N^3), once for each (inputs, outputs) in the life
of the program: the parameters found are kept, as bands of several k ask for the same. Any number of threads may
call. */
[[nodiscard]] GaussianProcess FitGaussianProcess(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& outputs);

/** Claims: at each single location, were the residual a draw of the fitted process, r_k(z) lies inside with the
probability of k standard deviations. Not sound: neither prior nor fit is justified away from the data, nor are the few
points of Z that are looked at all of it. */
class GaussianProcessBand final : public ResidualEnclosure {
 public:
  /** @param corners whether a query is looked at in the corners of its hull, too, or at its center alone.
  @throws std::invalid_argument if L names more than 10 coordinates. */
  GaussianProcessBand(const Setting& setting, double deviations, bool corners);

  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override;

 private:
  struct Row {
    double lower, upper;  // constant coordinate: its range; otherwise: the recording error
    double mean, scale;
    std::unique_ptr<const GaussianProcess> process{};
  };

  double deviations_;
  bool corners_;
  std::vector<int> active_;
  Eigen::VectorXd input_mean_, input_scale_;
  std::vector<Row> rows_;
};

[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeGaussianProcess2(const Setting& setting);
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeGaussianProcess3(const Setting& setting);

}  // namespace forereach::research

/** A plan certified in pieces of X_0, where the tube from all of X_0 is too wide: an abstention S, tried again.

The remainder of the nominal map falls with the square of a set's width, and the residual's spread with the width, so
the tubes from the parts of a set are together narrower than the tube from the whole. The hull of X_0 is halved along
one state, each part that is not certified then is halved again, and so on. The pieces cover X_0: if Certifier::Certify
certifies every one of them, what a certificate says is proven of X_0 (docs/soundness.md, 3.21).

Which state is halved is found by trying each once: what counts is by how much both halves together narrow the slice
that failed. Every halving of a state is expected to gain half as much as the one before. */
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "forereach/certify/certifier.h"
#include "forereach/certify/piece_cut.h"
#include "forereach/certify/tube.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

class Pieces final {
 public:
  static constexpr int kMost = 64;

  /** Has room for a tube and all pieces; nothing is allocated later. */
  Pieces() { cuts_.reserve(2 * kMost); }

  /** Certifies a plan, on which Certify has just abstained with kSafety, in pieces.
  @param whole that decision. @param most pieces, 2 .. kMost. @param goes_on asked before each call of Certify.
  @param first as JudgeSafety's: what fails before it does not count.
  @param tube of that call. With a certificate its slices after X_0 become boxes that contain those of all pieces.
  @return kCertified, with the witness of the piece that comes closest; otherwise kNone, and `tube` is unchanged.
  Without goes_on the result depends on nothing but the arguments. Cost: at most 2 n + 3 most calls of Certify. */
  [[nodiscard]] Decision Certify(const Certifier& certifier, const Plan& plan, const Zonotope& initial_set,
                                 const ObstacleView& obstacles, const Decision& whole, int most,
                                 const std::function<bool()>& goes_on, Tube& tube, int first = 0) noexcept;

  /** Of the last call: the calls of Certify that it has made, and, after a certificate, the tree and its pieces. */
  [[nodiscard]] int trials() const { return trials_; }
  [[nodiscard]] std::span<const PieceCut> cuts() const { return cuts_; }
  [[nodiscard]] int count() const { return (static_cast<int>(cuts_.size()) + 1) / 2; }

 private:
  using States = std::array<Interval, kMaxStates>;
  struct Part {
    States box;
    std::array<int, kMaxStates> halvings{};
  };
  struct Call {
    const Certifier& certifier;
    const Plan& plan;
    const ObstacleView& obstacles;
    int first;
    const std::function<bool()>& goes_on;
  };

  // Outcome kNone if time is up.
  [[nodiscard]] Decision Try(const Call& call, const Part& part) noexcept;
  [[nodiscard]] bool Rank(const Call& call, const Part& all, const Decision& whole, const Tube& tube) noexcept;
  [[nodiscard]] bool IsHopeless(const Call& call, Part part) noexcept;
  void Widen(int steps) noexcept;

  Tube tube_;  // of one piece
  Zonotope set_;
  std::array<States, kMaxSteps + 1> hulls_;  // of the pieces so far
  std::array<Part, kMost> waiting_;
  std::array<double, kMaxStates> gain_{};  // of halving a state for the first time
  std::vector<PieceCut> cuts_;
  int dim_ = 0, trials_ = 0;
};

/** Certifier::Certify, and after an abstention S the same in pieces, at most `most` of them; 1: never. Allocates
memory. */
[[nodiscard]] Decision CertifyInPieces(const Certifier& certifier, const Plan& plan, const Zonotope& initial_set,
                                       const ObstacleView& obstacles, int most, Tube& tube);

}  // namespace forereach

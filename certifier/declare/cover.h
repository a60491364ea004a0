/** What proves a bound over a box: the box bisected again and again, with a bound for each part that was not bisected
further. Plain data: whoever checks it needs to know nothing of how it was found. */
#pragma once

#include <vector>

#include "certifier/numerics/compilation.h"

namespace forereach {

/** A binary tree; node 0 stands for the whole box. An inner node cuts its box at w_argument = at into one part with
w_argument <= at and one with w_argument >= at. The leaves' boxes therefore cover the whole box. */
struct Cover {
  struct Node {
    int argument = -1;           ///< The one that is cut; -1 for a leaf.
    bool outside = false;        ///< Of a leaf: no point of its box lies in the domain.
    double number = 0;           ///< Of a leaf: the bound over its box. Else: where it is cut.
    int below = -1, above = -1;  ///< The two parts, by their place in `nodes`, behind their parent.
  };

  std::vector<Node> nodes;
};

}  // namespace forereach

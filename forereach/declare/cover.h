/** A cover: the proof of a bound over a box. The box is bisected repeatedly, and each part that is not bisected further
has a bound. It is plain data; a checker needs no knowledge of the search that found it. */
#pragma once

#include <vector>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** A binary tree. Node 0 has the whole box. An inner node cuts its box at w_argument = number into the part with
w_argument <= number and the part with w_argument >= number. So the boxes of the leaves cover the whole box. */
struct Cover {
  struct Node {
    int argument = -1;           ///< Index of the argument that is cut; -1 for a leaf.
    bool outside = false;        ///< Leaf: no point of its box lies in the domain.
    double number = 0;           ///< Leaf: the bound over its box. Inner node: the place of the cut.
    int below = -1, above = -1;  ///< Inner node: indices of the two parts in `nodes`, larger than its own.
  };

  std::vector<Node> nodes;
};

}  // namespace forereach

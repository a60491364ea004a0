/** Where X_0 was cut for a certificate in pieces (pieces.h): a tree in preorder, a lower part before its upper part. */
#pragma once

namespace forereach {

struct PieceCut {
  int state = -1;  ///< The part is halved along it; -1: the part is a piece.
  double at = 0;
};

}  // namespace forereach

/** What a test expects of an honest certificate. */
#pragma once

#include <gtest/gtest.h>

#include "verifier/verifier.h"

namespace forereach {

/** Whether a verdict confirms, with where it does not. */
[[nodiscard]] inline testing::AssertionResult IsConfirmed(const verifier::Verdict& verdict) {
  const verifier::Failure& failure = verdict.failure;
  if (verdict.status == verifier::Status::kConfirmed) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "step " << failure.step << ": " << failure.what << ": " << failure.found << ", "
                                     << failure.bound << ", excess " << failure.excess;
}

}  // namespace forereach

// Cover files: any bytes are a cover, which comes back the same once written and is confirmed or not, or refused with a
// ConfigError.
#include "fuzz/fuzz.h"
#include "fuzz/json_mutator.h"
#include "identify/cover_file.h"

namespace forereach {
namespace {

bool IsWhole(const CoverFile& file) {
  for (const verifier::SlopeClaim& claim : file.claims)
    for (const Cover::Node& node : claim.cover.nodes)
      if (node.argument >= 0 && (node.below < 0 || node.above < 0)) return false;
  return true;
}

// Deriving a bound anew takes longer than all the rest: of every sixteenth file the first claim, if it is small.
void CheckFirst(const CoverFile& file, const Config& config, const Digest& digest) {
  static const verifier::CoverChecker checker(config.problem->domain, *config.residual);
  if (digest[0] % 16 != 0 || file.claims.empty() || file.claims[0].cover.nodes.size() > 8) return;
  const verifier::CoverVerdict verdict = checker.Check(file.claims[0]);
  Require((verdict.answer == verifier::Answer::kYes) == verdict.what.empty());
  Require(verdict.answer != verifier::Answer::kYes || file.claims[0].bound >= 0);
}

}  // namespace

bool Try(Bytes data) {
  static const Config config = LoadConfig(FOREREACH_FUZZ_TASK);
  static MemoryFile file;
  const std::string& path = file.Write(data);
  CoverFile cover;
  if (!IsTaken([&] { cover = LoadCover(path, config); })) return false;
  const Digest digest = CoverDigest(cover.claims);
  CheckFirst(cover, config, digest);
  if (!IsWhole(cover)) return false;
  SaveCover(path, config, cover.claims);
  cover = LoadCover(path, config);
  Require(CoverDigest(cover.claims) == digest && cover.cover_digest == ToHex(digest));
  return true;
}

}  // namespace forereach

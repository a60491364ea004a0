// Cover files: any bytes are a cover, which comes back the same once written, or refused with a ConfigError.
#include "cli/cover_file.h"
#include "fuzz/fuzz.h"

namespace {

using namespace forereach;

bool IsWhole(const Cover& cover) {
  for (const Cover::Node& node : cover.nodes)
    if (node.argument >= 0 && (node.below < 0 || node.above < 0)) return false;
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Config config = LoadConfig(FOREREACH_FUZZ_TASK);
  static MemoryFile file;
  const std::string path = file.Write(Bytes(data, size));
  CoverFile cover;
  if (!IsTaken([&] { cover = LoadCover(path, config); })) return 0;
  const Digest digest = CoverDigest(cover.claims);
  for (const verifier::SlopeClaim& claim : cover.claims)
    if (!IsWhole(claim.cover)) return 0;
  SaveCover(path, config, cover.claims);
  cover = LoadCover(path, config);
  Require(CoverDigest(cover.claims) == digest && cover.cover_digest == ToHex(digest));
  return 0;
}

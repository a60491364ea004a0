// `forereach verify`'s JSON: any bytes are a document that is confirmed or not, or refused with a ConfigError.
#include "fuzz/fuzz.h"
#include "fuzz/json_mutator.h"
#include "records/certificate_files.h"

namespace forereach {
namespace {

// So that a try takes milliseconds.
bool IsSmall(const verifier::Certificate& certificate) {
  for (const verifier::RecordedSlice& slice : certificate.slices)
    if (slice.generators.cols() > 40) return false;
  return certificate.controls.cols() <= 4;
}

// @return whether there was a certificate to derive.
bool Verify(const CertificateFile& file) {
  bool any = false;
  const verifier::Verifier verifier(file.config.problem, verifier::MethodOf(*file.config.problem));
  for (const RecordedCertificate& recorded : file.certificates) {
    if (!IsSmall(recorded.certificate)) continue;
    any = true;
    const verifier::Verdict verdict = verifier.Verify(recorded.certificate);
    Require((verdict.status == verifier::Status::kConfirmed) == verdict.failure.what.empty());
    Require(verdict.status != verifier::Status::kConfirmed || recorded.certificate.controls.allFinite());
  }
  return any;
}

}  // namespace

bool Try(Bytes data) {
  static MemoryFile file;
  const std::string& path = file.Write(data);
  bool verified = false;
  return IsTaken([&] { verified = Verify(ReadAllCertificates(path, FOREREACH_FUZZ_TASK).front()); }) && verified;
}

}  // namespace forereach

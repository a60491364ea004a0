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

class Verifying final : public CertificateUser {
 public:
  void OnCertificate(RecordedCertificate&& recorded, const Basis* basis) override {
    if (!basis || !IsSmall(recorded.certificate)) return;
    any = true;
    const Problem& problem = *basis->task->problem;
    const verifier::Verdict verdict =
        verifier::Verifier(basis->task->problem, verifier::MethodOf(problem)).Verify(recorded.certificate);
    Require((verdict.status == verifier::Status::kConfirmed) == verdict.failure.what.empty());
    Require(verdict.status != verifier::Status::kConfirmed || recorded.certificate.controls.allFinite());
  }

  bool any = false;  // whether there was a certificate to derive
};

}  // namespace

bool Try(Bytes data) {
  static MemoryFile file;
  const std::string& path = file.Write(data);
  Verifying verifying;
  return IsTaken([&] { ReadCertificates(path, FOREREACH_FUZZ_TASK, {}, verifying); }) && verifying.any;
}

}  // namespace forereach

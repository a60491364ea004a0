// `verify` on a decision of which one thing was changed: each leaf of the document, in every way. What is not refused
// stands on a list here, with the reason.

#include "records/decision_json.h"
#include "tests/cli/program.h"
#include "tests/records/certificates.h"

namespace forereach::record_mutation_test {

using Json = nlohmann::json;
using Pointer = Json::json_pointer;

struct RecordMutation : testing::Test {
  RecordMutation() {
    scratch_.Write("plan.csv", "ax,ay\n1,0.5\n");
    const Output output = Forereach("certify --json --config config/point_mass.yaml --plan " + scratch_ / "plan.csv");
    EXPECT_EQ(output.code, 0) << output.text;
    valid_ = Json::parse(output.text);
    verifier_ = std::make_unique<verifier::Verifier>(config_.problem, verifier::MethodOf(*config_.problem));
  }

  // As verify_command.cpp: whether it is confirmed.
  [[nodiscard]] bool IsConfirmed(const std::string& text) const {
    try {
      const CertificateFile file = ReadCertificates(scratch_.Write("decision.json", text), "");
      if (file.certificates.size() != 1) return false;
      const RecordedCertificate& record = file.certificates[0];
      return record.missing.empty() && record.mismatches.empty() &&
             verifier_->Verify(record.certificate).status == verifier::Status::kConfirmed;
    } catch (const BadInput&) {
      return false;
    }
  }
  // As somebody would who knows how digests are made.
  [[nodiscard]] static std::string Resealed(Json document) {
    if (document.contains("tube") && document["digests"].is_object() && document["digests"].contains("tube"))
      document["digests"]["tube"] = ToHex(TubeDigest(document["tube"]));
    return document.dump();
  }

  // All values below, inner ones too.
  static void Collect(const Json& value, const Pointer& at, std::vector<Pointer>& all) {
    if (!at.empty()) all.push_back(at);
    if (value.is_object())
      for (const auto& [key, entry] : value.items()) Collect(entry, at / key, all);
    if (value.is_array())
      for (std::size_t i = 0; i < value.size(); ++i) Collect(value[i], at / i, all);
  }

  // Every changed document that is not the same as the valid one, with what was done.
  using Visit = std::function<void(const Pointer&, const std::string&, const Json&)>;
  void ForEachMutation(const Visit& visit) const {
    std::vector<Pointer> all;
    Collect(valid_, Pointer(), all);
    for (const Pointer& at : all) {
      const Json& value = valid_[at];
      const auto put = [&](const std::string& what, const Json& other) {
        if (other == value) return;  // 0 and 0.0 are the same number
        Json changed = valid_;
        changed[at] = other;
        visit(at, what, changed);
      };
      Json without = valid_;
      Json& parent = without[at.parent_pointer()];
      if (parent.is_object())
        parent.erase(at.back());
      else
        parent.erase(static_cast<std::size_t>(std::stoul(at.back())));
      visit(at, "delete", without);
      Json twice = valid_;
      Json& beside = twice[at.parent_pointer()];
      if (beside.is_array())
        beside.insert(beside.begin() + std::stol(at.back()), value);
      else
        beside[at.back() + "_too"] = value;
      visit(at, "duplicate", twice);
      put("null", nullptr);
      put("string", "1");
      put("bool", true);
      put("empty list", Json::array());
      put("empty object", Json::object());
      put("number", 1e300);
      if (value.is_array() && value.size() > 1)
        for (const std::size_t i : {std::size_t{1}, value.size() - 1}) {
          Json swapped = value;
          std::swap(swapped[0], swapped[i]);
          put("swap", swapped);
        }
      if (value.is_string()) put("empty text", "");
      if (value.is_string() && !value.get<std::string>().empty()) {
        std::string text = value;
        text.back() = text.back() == '0' ? '1' : '0';
        put("last letter", text);
        put("more text", value.get<std::string>() + " ");
      }
      if (value.is_boolean()) put("negate", !value.get<bool>());
      if (!value.is_number()) continue;
      const double number = value;
      put("zero", 0.0);
      put("negate", -number);
      put("next up", std::nextafter(number, std::numeric_limits<double>::infinity()));
      put("next down", std::nextafter(number, -std::numeric_limits<double>::infinity()));
      put("a thousandth less", number * 0.999);
      put("a thousandth more", number * 1.001);
    }
  }

  const ScratchDirectory scratch_;
  const Config config_ = LoadConfig(FOREREACH_SOURCE_DIR "/config/point_mass.yaml");
  Json valid_;
  std::unique_ptr<verifier::Verifier> verifier_;
};

// What a record may say otherwise: nothing of the tube, the plan or its inputs depends on it.
const char* WhyNothingDependsOn(const Pointer& at, const std::string& what, const Json& changed) {
  const std::string path = at.to_string();
  const bool is_number = changed.contains(at) && changed[at].is_number();
  if (path == "/elapsed_us" && is_number && changed[at] >= 0) return "how long it took claims nothing";
  if (path.starts_with("/inputs/config/") && changed.contains(at) && changed[at].is_string() && what != "delete")
    return "either path finds the task, whose digest is compared";
  return nullptr;
}

TEST_F(RecordMutation, TheUnchangedRecordIsConfirmed) { EXPECT_TRUE(IsConfirmed(valid_.dump())); }

TEST_F(RecordMutation, AChangeOfAnyValueIsRefused) {
  int mutations = 0;
  std::map<std::string, int> allowed;
  ForEachMutation([&](const Pointer& at, const std::string& what, const Json& changed) {
    ++mutations;
    if (!IsConfirmed(changed.dump())) return;
    const char* why = WhyNothingDependsOn(at, what, changed);
    EXPECT_NE(why, nullptr) << what << " of " << at << " is confirmed";
    if (why) ++allowed[why];
  });
  EXPECT_GT(mutations, 1500);
  EXPECT_EQ(allowed.size(), 2u) << "a reason that nothing needs";
}

// With the tube's digest made good again, what is confirmed has to be true all the same.
const char* WhyStillTrue(const Pointer& at, const std::string& what, const Json& changed, const Json& valid) {
  if (const char* why = WhyNothingDependsOn(at, what, changed)) return why;
  const std::string path = at.to_string();
  if (!path.starts_with("/tube/")) return nullptr;
  const bool is_number = changed.contains(at) && changed[at].is_number() && valid[at].is_number();
  const double now = is_number ? changed[at].get<double>() : 0, before = is_number ? valid[at].get<double>() : 0;
  const bool upper_bound = path.find("/half_width/") != path.npos || path.find("/remainder/") != path.npos ||
                           path.ends_with("/radius") || path.find("/envelope/upper/") != path.npos;
  if (is_number && upper_bound && now > before) return "a larger upper bound holds too";
  const bool lower_bound = path.find("/envelope/lower/") != path.npos || path.find("/clearance/") != path.npos;
  if (is_number && lower_bound && now < before) return "a smaller lower bound holds too";
  // Rounding: the certifier's bounds leave some 2^-43 of the sizes, and the slack among the generators is all of that.
  if (is_number && std::abs(now - before) <= 1e-11) return "less than what rounding was allowed for";
  if (path.find("/generators") == path.npos) return nullptr;
  if (what == "swap" && path.ends_with("/generators")) return "the same generators span the same set";
  if (is_number && now == -before) {
    const Json& column = valid[at.parent_pointer()];
    const auto zero = [](const Json& entry) { return std::abs(entry.get<double>()) <= 1e-11; };
    if (std::count_if(column.begin(), column.end(), zero) == std::ssize(column) - 1) return "an axis turned round";
  }
  if (what == "delete" || what == "duplicate") {  // of a whole column, which is no more than rounding
    const Json& column = valid[at];
    if (column.is_array() &&
        std::all_of(column.begin(), column.end(), [](const Json& e) { return std::abs(e.get<double>()) <= 1e-11; }))
      return "less than what rounding was allowed for";
  }
  return nullptr;
}

TEST_F(RecordMutation, ResealedIsRefusedUnlessItIsStillTrue) {
  int mutations = 0, refused = 0;
  std::map<std::string, int> allowed;
  ForEachMutation([&](const Pointer& at, const std::string& what, const Json& changed) {
    if (!at.to_string().starts_with("/tube")) return;
    ++mutations;
    if (!IsConfirmed(Resealed(changed))) {
      ++refused;
      return;
    }
    const char* why = WhyStillTrue(at, what, changed, valid_);
    EXPECT_NE(why, nullptr) << what << " of " << at << " is confirmed";
    if (why) ++allowed[why];
  });
  EXPECT_GT(refused, mutations / 2);
  for (const auto& [why, count] : allowed) std::cout << count << ": " << why << "\n";
}

// The holes that were found: each in a record that is consistent in itself.
TEST_F(RecordMutation, GeneratorsMergedIntoOneColumnAreRefused) {
  for (std::size_t t = 0; t < valid_["tube"].size(); ++t) {
    Json changed = valid_;
    std::vector<double> sums(4);
    for (const Json& column : changed["tube"][t]["generators"])
      for (std::size_t k = 0; k < 4; ++k) sums[k] += std::abs(column[k].get<double>());
    changed["tube"][t]["generators"] = Json::array({sums});
    EXPECT_FALSE(IsConfirmed(Resealed(changed))) << "slice " << t;
  }
}

TEST_F(RecordMutation, AKeyThatStandsTwiceIsRefused) {
  std::string text = valid_.dump();
  text.insert(text.find("\"message\""), "\"message\":\"certified: no obstacles\",");
  EXPECT_FALSE(IsConfirmed(text));
}

}  // namespace forereach::record_mutation_test

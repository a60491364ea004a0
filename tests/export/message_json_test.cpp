// Every field of every message type is in its JSON, and counts in a message are not believed.
#include "records/message_json.h"

#include <regex>

#include "tests/test.h"

#include "tests/messages.h"
#include "tests/paths.h"
#include "tests/tries.h"

namespace forereach::message_json_test {

using nlohmann::json;

// Types that are parts of a message, with that message and where its schema has them.
const std::map<std::string, std::pair<std::string, std::string>> kParts{
    {"obstacle_t", {"obstacles_t", "/properties/obstacle/items/properties"}},
    {"obstacle_shape_t", {"obstacles_t", "/properties/obstacle/items/properties/shape/properties"}},
    {"advice_change_t", {"advice_t", "/properties/change/items/properties"}}};

TEST(MessageJson, EveryFieldOfEveryTypeIsThere) {
  std::set<std::string> types;
  for (const std::string_view type : MessageTypes()) types.insert(std::string(type));
  for (const auto& file : std::filesystem::directory_iterator(FOREREACH_SOURCE_DIR "/lcmtypes")) {
    if (file.path().extension() != ".lcm") continue;
    const std::string type = file.path().stem();
    json properties;
    if (const auto part = kParts.find(type); part != kParts.end())
      properties = json::parse(SchemaOf(part->second.first)).at(json::json_pointer(part->second.second));
    else
      properties = json::parse(SchemaOf(type))["properties"];
    types.erase(type);
    std::string text = std::regex_replace(Read(file.path()), std::regex("//[^\n]*"), "");
    text = std::regex_replace(text.substr(text.find('{') + 1), std::regex("const [^;]*;"), "");
    static const std::regex field("\\w+\\s+(\\w+)[^;]*;");
    int fields = 0;
    for (std::sregex_iterator match(text.begin(), text.end(), field), end; match != end; ++match, ++fields)
      EXPECT_TRUE(properties.contains((*match)[1].str())) << type << "." << (*match)[1];
    EXPECT_GE(fields, 4) << type;
  }
  EXPECT_TRUE(types.empty()) << *types.begin() << " has no .lcm file";
}

TEST(MessageJson, OnlyEntriesInUseAreWritten) {
  certified_plan_t certified{};
  certified.plan.num_states = 2;
  certified.plan.num_inputs = 1;
  certified.plan.num_steps = 3;
  certified.slice_upper[3][1] = 0.1;
  const auto made = ToJsonMessage(Encode(certified));
  ASSERT_TRUE(made.has_value());
  EXPECT_EQ(made->type, "certified_plan_t");
  const json object = json::parse(made->json);
  EXPECT_EQ(object["plan"]["control"], json::parse("[[0.0],[0.0],[0.0]]"));
  EXPECT_EQ(object["slice_upper"], json::parse("[[0.0,0.0],[0.0,0.0],[0.0,0.0],[0.0,0.1]]"));
}

TEST(MessageJson, CountsOfAMessageAreBounded) {
  certified_plan_t certified{};
  certified.plan.num_states = certified.plan.num_inputs = certified.plan.num_steps = 32767;
  const json object = json::parse(ToJsonMessage(Encode(certified))->json);
  EXPECT_EQ(object["slice_lower"].size(), 129u);
  EXPECT_EQ(object["slice_lower"][0].size(), 16u);
  EXPECT_EQ(object["plan"]["control"].size(), 128u);
  certified.plan.num_states = certified.plan.num_inputs = certified.plan.num_steps = -32768;
  EXPECT_EQ(json::parse(ToJsonMessage(Encode(certified))->json)["slice_lower"].size(), 0u);
  EXPECT_EQ(json::parse(ToJsonMessage(Encode(obstacles_t{.num_obstacles = 32767}))->json)["obstacle"].size(), 64u);
}

TEST(MessageJson, NumbersThatAreNotFiniteAreLeftOut) {
  decision_t decision{
      .outcome = decision_t::CERTIFIED, .margin = std::numeric_limits<double>::infinity(), .threshold = std::nan("")};
  const json object = json::parse(ToJsonMessage(Encode(decision))->json);
  EXPECT_FALSE(object.contains("margin"));
  EXPECT_FALSE(object.contains("threshold"));
  EXPECT_THAT(object, Holds({{"outcome", 1}, {"outcome_name", "certified"}}));
}

TEST(MessageJson, AnAdviceIsOfTheCandidateThatItIsAbout) {
  advice_t advice{.plan_id = 7, .outcome = decision_t::ABSTAIN_SAFETY};
  advice.plan_digest[31] = 9;
  const auto summary = Summarize(Encode(advice));
  ASSERT_TRUE(summary && summary->is_of_plan);
  EXPECT_FIELDS(*summary, (plan_id, 7), (what, "abstain_safety"), (plan, GetDigest(advice.plan_digest)));
}

TEST(MessageJson, RefusesBytesThatAreNoWholeMessage) {
  auto bytes = Encode(decision_t{});
  EXPECT_TRUE(Summarize(bytes).has_value());
  bytes.push_back(0);
  EXPECT_FALSE(ToJsonMessage(bytes).has_value()) << "a trailing byte";
  bytes.resize(20);
  EXPECT_FALSE(Summarize(bytes).has_value()) << "cut";
  EXPECT_FALSE(Summarize({}).has_value());
  EXPECT_THROW(static_cast<void>(SchemaOf("hovercraft_t")), std::invalid_argument);
}

bool Fits(const json& value, const json& schema) {
  const std::string type = schema["type"];
  if (type == "string") return value.is_string();
  if (type == "integer") return value.is_number_integer();
  if (type == "number") return value.is_number();
  if (type == "object" ? !value.is_object() : !value.is_array()) return false;
  for (const auto& [name, each] : value.items()) {
    if (type == "object" && !(schema["properties"].contains(name) && Fits(each, schema["properties"][name])))
      return false;
    if (type == "array" && !each.is_null() && !Fits(each, schema["items"])) return false;
  }
  return true;
}

// Any bytes behind a genuine fingerprint: numbers of any kind, counts without sense, texts without an end.
template <class Message>
void TryAnyBytes(std::mt19937_64& random) {
  const json schema = json::parse(SchemaOf(Message::getTypeName()));
  for (int i = 0; i < Tries(300); ++i) {
    auto bytes = Encode(Message{});
    const std::size_t changes = i % 2 == 0 ? bytes.size() : 1 + random() % 20;
    for (std::size_t k = 0; k < changes; ++k)
      bytes[8 + random() % (bytes.size() - 8)] = static_cast<std::uint8_t>(random() % 3 == 0 ? 0xff : random());
    const auto made = ToJsonMessage(bytes);
    ASSERT_TRUE(made.has_value());
    EXPECT_TRUE(Fits(json::parse(made->json), schema)) << made->json;
    EXPECT_TRUE(Summarize(bytes).has_value());
  }
}

TEST(MessageJson, AnyMessageFitsItsSchema) {
  const std::uint64_t seed = 20261124;
  std::mt19937_64 random(seed);
  SCOPED_TRACE(seed);
  TryAnyBytes<candidate_plan_t>(random);
  TryAnyBytes<certified_plan_t>(random);
  TryAnyBytes<certifier_status_t>(random);
  TryAnyBytes<decision_t>(random);
  TryAnyBytes<execution_event_t>(random);
  TryAnyBytes<fault_t>(random);
  TryAnyBytes<logger_status_t>(random);
  TryAnyBytes<obstacles_t>(random);
  TryAnyBytes<robot_state_t>(random);
  TryAnyBytes<transition_t>(random);
  TryAnyBytes<withdrawal_t>(random);
}

}  // namespace forereach::message_json_test

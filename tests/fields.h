/** Expectations of several members of one object. */
#pragma once

#include <utility>

#include <gtest/gtest.h>

namespace forereach {

/** What is about to go, as a value; anything else as it is. */
template <class Object>
Object Kept(Object&& object) {
  return std::forward<Object>(object);
}

}  // namespace forereach

/** `EXPECT_FIELDS(Plan(), (step, 3), (size(), 4));` is `const auto plan = Plan(); EXPECT_EQ(plan.step, 3);
EXPECT_EQ(plan.size(), 4);`, of up to 40 members. */
#define EXPECT_FIELDS(object, ...)                           \
  do {                                                       \
    SCOPED_TRACE(#object);                                   \
    auto&& object_ = ::forereach::Kept(object);              \
    FOREREACH_EXPAND(FOREREACH_FIELDS(object_, __VA_ARGS__)) \
  } while (false)

#define FOREREACH_FIELDS(object, pair, ...) \
  FOREREACH_FIELD(object, FOREREACH_OF_PAIR pair) __VA_OPT__(FOREREACH_MORE FOREREACH_NOTHING()(object, __VA_ARGS__))
#define FOREREACH_FIELD(object, ...) FOREREACH_EXPECT(object, __VA_ARGS__)
#define FOREREACH_EXPECT(object, field, ...) EXPECT_EQ((object).field, __VA_ARGS__);
#define FOREREACH_OF_PAIR(...) __VA_ARGS__
#define FOREREACH_MORE() FOREREACH_FIELDS
#define FOREREACH_NOTHING

/** Expands its argument again and again: a macro that names itself is expanded once a time. */
#define FOREREACH_EXPAND(...) FOREREACH_EXPAND_3(FOREREACH_EXPAND_3(FOREREACH_EXPAND_3(__VA_ARGS__)))
#define FOREREACH_EXPAND_3(...) FOREREACH_EXPAND_2(FOREREACH_EXPAND_2(FOREREACH_EXPAND_2(__VA_ARGS__)))
#define FOREREACH_EXPAND_2(...) FOREREACH_EXPAND_1(FOREREACH_EXPAND_1(FOREREACH_EXPAND_1(__VA_ARGS__)))
#define FOREREACH_EXPAND_1(...) __VA_ARGS__

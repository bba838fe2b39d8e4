#include "common/base/trace.h"

#include <gtest/gtest.h>

#include <set>

namespace radbake {
namespace {

// The example of the Recommendation, section 3.2.3.
constexpr const char* kTrace = "4bf92f3577b34da6a3ce929d0e0e4736";
constexpr const char* kParent = "00f067aa0ba902b7";
constexpr const char* kExample = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

TEST(Trace, ReadsTheExampleOfTheRecommendation) {
  const auto trace = parse_traceparent(kExample);
  ASSERT_TRUE(trace);
  EXPECT_EQ(trace->trace_id, kTrace);
  EXPECT_EQ(trace->parent_id, kParent);
  EXPECT_TRUE(trace->is_sampled);
  EXPECT_EQ(to_traceparent(*trace), kExample);
}

TEST(Trace, ReadsOneThatIsNotSampledAndFlagsItDoesNotKnow) {
  EXPECT_FALSE(parse_traceparent("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-00")->is_sampled);
  EXPECT_TRUE(parse_traceparent("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-ff")->is_sampled);
}

TEST(Trace, ReadsTheBeginningOfANewerVersion) {
  EXPECT_TRUE(parse_traceparent("01-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"));
  EXPECT_TRUE(parse_traceparent("cc-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-what-is-to-come"));
}

TEST(Trace, RefusesWhatIsNotOne) {
  for (const char* wrong : {
           "", "00", "4bf92f3577b34da6a3ce929d0e0e4736",
           "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7",      // no flags
           "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-1",    // half a flag
           "00-4bf92f3577b34da6a3ce929d0e0e473-600f067aa0ba902b7-01",   // a shifted sign
           "00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01",   // capitals
           "00-4bf92f3577b34da6a3ce929d0e0e473g-00f067aa0ba902b7-01",   // not hexadecimal
           "00-00000000000000000000000000000000-00f067aa0ba902b7-01",   // no trace
           "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01",   // no parent
           "ff-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",   // the version that is none
           "0x-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",   // not a version
           "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-zz",   // not flags
           "00_4bf92f3577b34da6a3ce929d0e0e4736_00f067aa0ba902b7_01",   // other signs
           "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-",  // longer than version 00 is
           "01-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01x",  // goes on without a sign
           " 00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",  // a space
       }) {
    EXPECT_FALSE(parse_traceparent(wrong)) << wrong;
  }
}

TEST(Trace, IsNewEachTime) {
  std::set<std::string> ids;
  for (int i = 0; i < 100; ++i) {
    const TraceContext trace = new_trace();
    const auto read = parse_traceparent(to_traceparent(trace));
    ASSERT_TRUE(read) << to_traceparent(trace);
    EXPECT_EQ(read->trace_id, trace.trace_id);
    ids.insert(trace.trace_id);
    ids.insert(trace.parent_id);
  }
  EXPECT_EQ(ids.size(), 200u);
}

TEST(Trace, MakesTwoDigitsOfARandomByte) {
  EXPECT_EQ(random_hex(0), "");
  EXPECT_EQ(random_hex(5).size(), 10u);
  EXPECT_NE(random_hex(16), random_hex(16));
}

}  // namespace
}  // namespace radbake

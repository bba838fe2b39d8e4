#include "server/service/server_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "radbake/v1/server.pb.h"
#include "server/service/config_values.h"

namespace radbake::service {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Writes a configuration file and reads it.
class ConfigTest : public ::testing::Test {
 protected:
  ~ConfigTest() override { std::filesystem::remove(path_); }

  Result<ParsedConfig> read(const std::string& text, std::vector<std::string> arguments = {}) {
    std::ofstream(path_) << text;
    arguments.insert(arguments.end(), {"--config", path_});
    return parse_config(arguments);
  }
  std::string error_of(const std::string& text) {
    const auto parsed = read(text);
    return parsed.ok() ? "accepted" : parsed.error().message;
  }

  const std::string path_ = ::testing::TempDir() + "radbaked-" + std::to_string(getpid()) + ".conf";
};

/// What --print-config prints, as key and value; keys that have no value are commented out.
std::map<std::string, std::string> printed(const std::vector<std::string>& arguments = {}) {
  std::vector<std::string> all = arguments;
  all.push_back("--print-config");
  const auto parsed = parse_config(all);
  EXPECT_TRUE(parsed.ok()) << parsed.error().message;
  std::map<std::string, std::string> keys;
  std::istringstream lines(parsed->answer.value_or(""));
  const std::regex key_line("(# )?([a-z-]+)=(.*)");
  std::smatch match;
  for (std::string line; std::getline(lines, line);) {
    if (std::regex_match(line, match, key_line)) keys[match[2]] = match[3];
  }
  return keys;
}

const std::vector<std::string> kBadNumbers = {
    "", "-1", "+1", "1.5", "1e3", "0x10", "ten", "1 2", "1,2", "1K", "99999999999999999999", "true"};
const std::vector<std::string> kBadSizes = {
    "", "-1", "1.5M", "M", "1X", "1KB", "1k", "1 M", "0x10", "ten", "1E", "99999999999999999999", "99999999T"};
const std::vector<std::string> kBadFlags = {"", "yes", "1", "0", "on", "TRUE", "maybe"};

/// Values that each key refuses. A key that is not here fails the test: so does one that is no longer.
std::map<std::string, std::vector<std::string>> bad_values() {
  const auto with = [](std::vector<std::string> values, std::initializer_list<const char*> more) {
    values.insert(values.end(), more.begin(), more.end());
    return values;
  };
  return {
      {"listen",
       {"", "7419", "host:", ":7419", "host:65536", "host:-1", "host:http", "::1:7419", "[::1]", "unix:", "a b:1",
        "unix:" + std::string(108, 'x')}},
      {"admin-listen", {"", "7420", "host:", "127.0.0.1:65536", "unix:/run/admin"}},
      {"admin-open", kBadFlags},
      {"data", {""}},
      {"costs", {""}},
      {"worker", {""}},
      {"threads", with(kBadNumbers, {"1025"})},
      {"drain-grace", {"", "-1", "nan", "inf", "1e3", "5s", "86401", "0x5"}},
      {"chunk-bytes", with(kBadSizes, {"1023", "4M"})},
      {"max-message-bytes", with(kBadSizes, {"1K", "2G"})},
      {"max-digests-per-call", with(kBadNumbers, {"0", "10001"})},
      {"max-blob-bytes", with(kBadSizes, {"1023K", "2T"})},
      {"max-manifest-bytes", with(kBadSizes, {"1023", "2G"})},
      {"max-meshes", with(kBadNumbers, {"0", "1000001"})},
      {"max-textures", with(kBadNumbers, {"1000001"})},
      {"max-lights", with(kBadNumbers, {"1000001"})},
      {"max-vertices", with(kBadNumbers, {"2", "4000000001"})},
      {"max-triangles", with(kBadNumbers, {"0", "1000000001"})},
      {"max-texture-pixels", with(kBadNumbers, {"0", "1073741825"})},
      {"min-atlas-size", with(kBadNumbers, {"0", "65537"})},
      {"max-atlas-size", with(kBadNumbers, {"0", "65537"})},
      {"max-rays", with(kBadNumbers, {"0", "1073741825"})},
      {"max-patches", with(kBadNumbers, {"0", "1000000001"})},
      {"max-queued-bakes", with(kBadNumbers, {"0", "1000001"})},
      {"max-running-bakes", with(kBadNumbers, {"0", "1025"})},
      {"max-attempts", with(kBadNumbers, {"0", "1000001"})},
      {"max-restarts", with(kBadNumbers, {"0", "1000001"})},
      {"max-bake-time", {"", "-1", "1e3", "5s", "31622401"}},
      {"max-bake-memory-bytes", with(kBadSizes, {"1025T"})},
      {"max-content-bytes", with(kBadSizes, {"1025T"})},
      {"tls-cert", {""}},
      {"tls-key", {""}},
      {"tls-client-ca", {""}},
      {"tokens", {""}},
      {"insecure-listen", kBadFlags},
      {"max-connections", with(kBadNumbers, {"0", "1000001"})},
      {"max-calls-per-connection", with(kBadNumbers, {"0", "1000001"})},
      {"max-uploads", with(kBadNumbers, {"0", "1000001"})},
      {"max-uploads-per-tenant", with(kBadNumbers, {"0", "1000001"})},
      {"max-downloads", with(kBadNumbers, {"0", "1000001"})},
      {"max-downloads-per-tenant", with(kBadNumbers, {"0", "1000001"})},
      {"max-watches", with(kBadNumbers, {"0", "1000001"})},
      {"max-watches-per-tenant", with(kBadNumbers, {"0", "1000001"})},
      {"max-running-plans", with(kBadNumbers, {"0", "1025"})},
      {"min-free-disk-bytes", with(kBadSizes, {"1025T"})},
      {"log-json", kBadFlags},
      {"log-level", {"", "loud", "INFO", "warn"}},
  };
}

TEST_F(ConfigTest, RefusesEveryBadValueOfEveryKeyWithKeyValueAndWhatWasExpected) {
  std::set<std::string> tested;
  for (const auto& [key, values] : bad_values()) {
    tested.insert(key);
    for (const std::string& value : values) {
      const std::string in_file = error_of("\n" + key + " = " + value + "\n");
      EXPECT_THAT(in_file, AllOf(HasSubstr(key), HasSubstr("'" + value.substr(0, 60)), HasSubstr("expected "),
                                 HasSubstr("line 2 of the configuration file")));
      EXPECT_EQ(in_file.find('\n'), std::string::npos);
    }
  }
  std::set<std::string> keys;
  for (const auto& [key, value] : printed()) keys.insert(key);
  EXPECT_EQ(tested, keys);
}

TEST_F(ConfigTest, RefusesBadValuesOnTheCommandLineToo) {
  for (const auto& [key, values] : bad_values()) {
    if (values == kBadFlags) continue;  // a flag of the command line is there or not
    for (const std::string& value : values) {
      if (value.empty()) continue;
      const auto parsed = parse_config({"--" + key + "=" + value});
      ASSERT_FALSE(parsed.ok()) << key << "=" << value;
      EXPECT_EQ(parsed.error().code, ErrorCode::kInvalidArgument);
      EXPECT_THAT(parsed.error().message, AllOf(HasSubstr(key + " is '" + value + "': expected ")));
    }
  }
}

TEST_F(ConfigTest, RefusesWhatIsNoKeyAndWhatIsNoLine) {
  EXPECT_THAT(error_of("max-raise=3\n"), AllOf(HasSubstr("line 1"), HasSubstr("'max-raise'"), HasSubstr("'3'"),
                                               HasSubstr("expected one of the keys")));
  EXPECT_THAT(error_of("threads\n"), HasSubstr("'threads' has no '=': expected key=value"));
  EXPECT_THAT(error_of("threads=1\n\n[section]\n"), AllOf(HasSubstr("line 3"), HasSubstr("'[section]' is a section")));
  EXPECT_THAT(error_of("threads=1\nlog-json=true\nthreads=2\n"),
              AllOf(HasSubstr("line 3"), HasSubstr("threads with the value '2' stands on line 1 already")));
  // What is of the command line alone.
  for (const char* key : {"config", "help", "version", "print-config", "exit-with-parent"}) {
    EXPECT_THAT(error_of(std::string(key) + "=true\n"), HasSubstr(std::string("'") + key + "'"));
  }
}

TEST_F(ConfigTest, RefusesAFileThatCannotBeRead) {
  for (const std::string& file : {std::string("/no/such/file"), ::testing::TempDir()}) {
    const auto parsed = parse_config({"--config", file});
    ASSERT_FALSE(parsed.ok());
    EXPECT_EQ(parsed.error().message, "config is '" + file + "': expected a file that can be read");
  }
}

TEST_F(ConfigTest, RefusesOptionsThatDoNotExistAndThoseGivenTwice) {
  EXPECT_THAT(parse_config({"--no-such-option"}).error().message, HasSubstr("--no-such-option"));
  EXPECT_THAT(parse_config({"stray"}).error().message, HasSubstr("stray"));
  EXPECT_THAT(parse_config({"--threads", "1", "--threads", "2"}).error().message, HasSubstr("--threads"));
}

TEST_F(ConfigTest, RefusesValuesThatContradictEachOther) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"chunk-bytes=1M\n", "chunk-bytes is '1M': expected at most max-message-bytes, which is 1M"},
      {"max-manifest-bytes=2M\nmax-blob-bytes=1M\n", "max-manifest-bytes is '2M': expected at most max-blob-bytes"},
      {"min-atlas-size=128\nmax-atlas-size=64\n", "min-atlas-size is '128': expected at most max-atlas-size"},
      {"admin-listen=127.0.0.1:7419\n", "admin-listen is '127.0.0.1:7419': expected another port than listen"},
      {"listen=0.0.0.0:7000\nadmin-listen=127.0.0.1:7000\n", "expected another port than listen"},
      {"admin-listen=0.0.0.0:7420\n", "admin-listen is '0.0.0.0:7420': expected an address of the loopback"},
      {"admin-listen=[::]:7420\n", "expected an address of the loopback"},
      {"admin-listen=example.org:7420\n", "expected an address of the loopback"},
      {"listen=0.0.0.0:7419\n", "--listen 0.0.0.0:7419 can be reached from other machines"},
      {"listen=0.0.0.0:7419\ntls-cert=c\ntls-key=k\n", "needs --tls-client-ca or --tokens"},
      {"tls-cert=c\n", "--tls-cert c needs --tls-key"},
      {"listen=example.org:7419\ntls-client-ca=a\n", "--tls-client-ca a needs --tls-cert"},
  };
  for (const auto& [text, expected] : cases) EXPECT_THAT(error_of(text), HasSubstr(expected));
}

TEST_F(ConfigTest, AcceptsWhatDoesNotContradict) {
  for (const char* text :
       {"admin-listen=0.0.0.0:7420\nadmin-open=true\n", "admin-listen=127.0.0.1:0\nlisten=127.0.0.1:0\n",
        "admin-listen=127.0.0.9:7420\n", "admin-listen=[::1]:7420\n", "admin-listen=localhost:7420\n",
        "listen=unix:/run/radbake.sock\nadmin-listen=127.0.0.1:7419\n",
        "listen=192.0.2.1:7420\nadmin-listen=127.0.0.1:7420\ninsecure-listen=true\n",
        "listen=0.0.0.0:7419\ntls-cert=c\ntls-key=k\ntokens=t\n",
        // What a name stands for shows at the start.
        "listen=example.org:7419\n"}) {
    const auto parsed = read(text);
    EXPECT_TRUE(parsed.ok()) << text << parsed.error().message;
  }
}

TEST_F(ConfigTest, ReadsSizesCommentsSpacesAndUnderscores) {
  const auto parsed = read(
      "# a comment\r\n; another\n\n  max_blob_bytes = 2G  \nchunk-bytes=65536\nmin-free-disk=0\n"
      "max-running=3\ndrain-grace=0.25\nlog-json=true\n");
  ASSERT_TRUE(parsed.ok()) << parsed.error().message;
  const BakeServerOptions& server = parsed->config.server;
  EXPECT_EQ(server.limits.max_blob_bytes, std::uint64_t{2} << 30);
  EXPECT_EQ(server.limits.chunk_bytes, 65536u);
  EXPECT_EQ(server.limits.min_free_disk_bytes, 0u);
  EXPECT_EQ(server.limits.max_running_bakes, 3u);
  EXPECT_EQ(server.drain_grace, std::chrono::milliseconds(250));
  EXPECT_TRUE(parsed->config.log.is_json);
}

TEST_F(ConfigTest, LetsTheCommandLineWin) {
  const auto parsed = read("threads=3\nmax-running-bakes=2\nlog-level=error\n", {"--threads", "5", "--max-running=4"});
  ASSERT_TRUE(parsed.ok()) << parsed.error().message;
  EXPECT_EQ(parsed->config.server.max_threads, 5u);
  EXPECT_EQ(parsed->config.server.limits.max_running_bakes, 4u);
  EXPECT_EQ(parsed->config.log.level, "error");
}

TEST_F(ConfigTest, ReadsNoFileUnlessOneIsNamed) {
  const auto parsed = parse_config({});
  ASSERT_TRUE(parsed.ok());
  EXPECT_EQ(parsed->config.server.admin_listen, "");
  EXPECT_EQ(parsed->config.server.drain_grace, std::chrono::seconds(5));
  EXPECT_EQ(parse_config({"--exit-with-parent"})->config.server.drain_grace, std::chrono::seconds(0));
  EXPECT_EQ(parse_config({"--exit-with-parent", "--drain-grace", "2"})->config.server.drain_grace,
            std::chrono::seconds(2));
}

TEST_F(ConfigTest, PrintsWhatItReads) {
  const std::vector<std::string> arguments = {
      "--listen", "unix:/run/r.sock", "--admin-listen", "127.0.0.1:1", "--costs",       "/tmp/costs", "--max-rays",
      "12345",    "--chunk-bytes",    "100000",         "--log-json",  "--drain-grace", "7.5",        "--admin-open"};
  std::vector<std::string> all = arguments;
  all.push_back("--print-config");
  const auto first = parse_config(all);
  ASSERT_TRUE(first.ok()) << first.error().message;
  const auto second = read(*first->answer, {"--print-config"});
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(*first->answer, *second->answer);
  const auto keys = printed(arguments);
  EXPECT_EQ(keys.at("max-rays"), "12345");
  EXPECT_EQ(keys.at("log-json"), "true");
  EXPECT_EQ(keys.at("max-blob-bytes"), "1G");
}

TEST_F(ConfigTest, SetsEveryLimitThatClientsAreTold) {
  const v1::Limits defaults = limits_message<v1::Limits>(Limits());
  const auto* fields = v1::Limits::descriptor();
  const auto* reflection = defaults.GetReflection();
  for (int i = 0; i < fields->field_count(); ++i) {
    std::string key = fields->field(i)->name();
    std::replace(key.begin(), key.end(), '_', '-');
    const std::uint64_t doubled = 2 * reflection->GetUInt64(defaults, fields->field(i));
    const auto parsed = read(key + "=" + std::to_string(doubled) + "\n");
    ASSERT_TRUE(parsed.ok()) << parsed.error().message;
    const v1::Limits told = limits_message<v1::Limits>(parsed->config.server.limits);
    for (int j = 0; j < fields->field_count(); ++j) {
      const std::uint64_t value = reflection->GetUInt64(told, fields->field(j));
      EXPECT_EQ(value, reflection->GetUInt64(defaults, fields->field(j)) * (j == i ? 2 : 1)) << key;
    }
  }
}

TEST_F(ConfigTest, FindsOnThisHostWhatOnlyShowsThere) {
  ServerConfig config = parse_config({})->config;
  config.server.data = ::testing::TempDir();
  config.server.queue.worker.program = "/bin/sh";
  EXPECT_TRUE(check_host(config).ok());
  config.server.queue.worker.program = "/no/such/worker";
  EXPECT_THAT(check_host(config).error().message,
              HasSubstr("worker is '/no/such/worker': expected the radbake-worker"));
  for (const char* folder : {"/dev/null", "/dev/null/below", "/proc/below"}) {
    config.server.data = folder;
    EXPECT_THAT(check_host(config).error().message,
                AllOf(HasSubstr(std::string("data is '") + folder), HasSubstr("expected a folder")));
  }
}

TEST(ConfigValues, WritesBytesInTheLargestUnitThatDividesThem) {
  EXPECT_EQ(write_bytes(0), "0");
  EXPECT_EQ(write_bytes(1023), "1023");
  EXPECT_EQ(write_bytes(131072), "128K");
  EXPECT_EQ(write_bytes((1 << 20) + 1), "1048577");
  EXPECT_EQ(write_bytes(std::uint64_t{3} << 40), "3T");
}

}  // namespace
}  // namespace radbake::service

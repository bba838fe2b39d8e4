#include "server/service/server_config.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <memory>
#include <utility>

#include "common/base/version.h"
#include "server/access/access_options.h"
#include "server/access/listen_address.h"
#include "server/service/config_file.h"
#include "server/service/config_values.h"

namespace radbake::service {
namespace {

constexpr std::uint64_t kKiB = 1024, kMiB = 1024 * kKiB, kGiB = 1024 * kMiB, kTiB = 1024 * kGiB;
constexpr std::uint64_t kMaxThreads = 1024;
/// A message around a chunk: the digest, the offset, the field's own bytes.
constexpr std::uint64_t kChunkOverheadBytes = 4 * kKiB;
/// gRPC takes an int; the server's own messages end here.
constexpr std::uint64_t kMaxMessageBytes = kGiB;
constexpr std::uint64_t kMaxChunkBytes = 2 * kMiB;
constexpr std::chrono::milliseconds kDrainGrace{5000};

std::filesystem::path default_data_folder() {
  if (const char* data = std::getenv("XDG_DATA_HOME"); data && *data) return std::filesystem::path(data) / "radbake";
  if (const char* home = std::getenv("HOME"); home && *home) {
    return std::filesystem::path(home) / ".local" / "share" / "radbake";
  }
  return "radbake-data";
}

std::filesystem::path default_worker() {
  std::error_code ignored;
  return std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path() / "radbake-worker";
}

/// Declares options whose bad values are told in one way.
class OptionList {
 public:
  OptionList(CLI::App& app, std::shared_ptr<ConfigFile> file) : app_(app), file_(std::move(file)) {}

  /// names: "--data", or "--max-running-bakes,--max-running": the first is the key. value holds the default.
  template <typename Read, typename Value>
  CLI::Option* add(const std::string& names, Value& value, const ValueKind<Read>& kind, const std::string& help) {
    const std::string key = names.substr(2, names.find(',') - 2);
    const auto take = [&value, kind, key, file = file_](const CLI::results_t& written) {
      const auto read = kind.read(written.front());
      if (!read) throw CLI::ValidationError(complaint(key, written.front(), kind.expected, *file));
      value = static_cast<Value>(*read);
      return true;
    };
    return app_.add_option(names, take, help)
        ->type_name(kind.type_name)
        ->default_str(kind.write(static_cast<Read>(value)));
  }

 private:
  static std::string complaint(const std::string& key, const std::string& value, const std::string& expected,
                               const ConfigFile& file) {
    return key + " is '" + value + "'" + file.place_of(key) + ": expected " + expected;
  }

  CLI::App& app_;
  std::shared_ptr<ConfigFile> file_;
};

/// The limits that clients are told, by their names.
void declare_limits(OptionList& options, Limits& limits) {
  options.add("--chunk-bytes", limits.chunk_bytes, byte_size(kKiB, kMaxChunkBytes),
              "Data in a chunk of an upload or a download");
  options.add("--max-message-bytes", limits.max_message_bytes, byte_size(64 * kKiB, kMaxMessageBytes),
              "A message that the server receives");
  options.add("--max-digests-per-call", limits.max_digests_per_call, whole_number(1, 10'000), "Digests in FindMissing");
  options.add("--max-blob-bytes", limits.max_blob_bytes, byte_size(kMiB, kTiB), "A mesh, a texture, a layer");
  options.add("--max-manifest-bytes", limits.max_manifest_bytes, byte_size(kKiB, kGiB),
              "The list of what a scene consists of: the one thing of a client's that the server itself reads");
  options.add("--max-meshes", limits.max_meshes, whole_number(1, 1'000'000), "Meshes of a scene");
  options.add("--max-textures", limits.max_textures, whole_number(0, 1'000'000), "Textures of a scene");
  options.add("--max-lights", limits.max_lights, whole_number(0, 1'000'000), "Lights of a scene, and light profiles");
  options.add("--max-vertices", limits.max_vertices, whole_number(3, 4'000'000'000), "Vertices of a scene");
  options.add("--max-triangles", limits.max_triangles, whole_number(1, 1'000'000'000), "Triangles of a scene");
  options.add("--max-texture-pixels", limits.max_texture_pixels, whole_number(1, 1 << 30), "Pixels of a texture");
  options.add("--min-atlas-size", limits.min_atlas_size, whole_number(1, 65'536),
              "Side of a lightmap at least, texels");
  options.add("--max-atlas-size", limits.max_atlas_size, whole_number(1, 65'536), "Side of a lightmap at most, texels");
  options.add("--max-rays", limits.max_rays, whole_number(1, 1 << 30), "Rays of a texel");
  options.add("--max-patches", limits.max_patches, whole_number(1, 1'000'000'000), "Patches of a scene");
  options.add("--max-queued-bakes", limits.max_queued_bakes, whole_number(1, 1'000'000),
              "Bakes that wait; a submit above it is refused");
  options.add("--max-running-bakes,--max-running", limits.max_running_bakes, whole_number(1, 1024),
              "Bakes at the same time");
  options.add("--max-content-bytes", limits.max_content_bytes, byte_size(0, 1024 * kTiB),
              "Scenes and results of a tenant; where an upload does not fit, what nobody needs is removed first; 0: as "
              "the disk has");
  options.add("--max-running-plans", limits.max_running_plans, whole_number(1, 1024), "Plans at the same time");
  constexpr std::uint64_t kMostCalls = 1'000'000;
  options.add("--max-connections", limits.max_connections, whole_number(1, kMostCalls),
              "Connections at the same time; one above is closed");
  options.add("--max-calls-per-connection", limits.max_calls_per_connection, whole_number(1, kMostCalls),
              "Calls at the same time on one connection");
  options.add("--max-uploads", limits.max_uploads, whole_number(1, kMostCalls),
              "Uploads at the same time; each holds a message of memory");
  options.add("--max-uploads-per-tenant", limits.max_uploads_per_tenant, whole_number(1, kMostCalls), "Of one tenant");
  options.add("--max-downloads", limits.max_downloads, whole_number(1, kMostCalls),
              "Downloads at the same time; each holds a chunk of memory");
  options.add("--max-downloads-per-tenant", limits.max_downloads_per_tenant, whole_number(1, kMostCalls),
              "Of one tenant");
  options.add("--max-watches", limits.max_watches, whole_number(1, kMostCalls), "Watches of bakes at the same time");
  options.add("--max-watches-per-tenant", limits.max_watches_per_tenant, whole_number(1, kMostCalls), "Of one tenant");
  options.add("--min-free-disk-bytes,--min-free-disk", limits.min_free_disk_bytes, byte_size(0, 1024 * kTiB),
              "Free space on the data folder's disk, below which uploads and submits are refused and the server is "
              "not ready; 0: no such floor");
}

/// Who may call, and over what.
void declare_access(CLI::App& app, OptionList& options, access::AccessOptions& access) {
  options.add("--tls-cert", access.tls.certificate, path_of("a file"),
              "Speak TLS with this certificate and its chain (PEM)");
  options.add("--tls-key", access.tls.key, path_of("a file"), "Its private key (PEM, without a password)");
  options.add("--tls-client-ca", access.tls.client_ca, path_of("a file"),
              "Clients show certificates that these authorities signed: CN is the tenant, OU=admin an admin");
  options.add("--tokens", access.tokens, path_of("a file"),
              "Clients show bearer tokens: one 'SHA256 TENANT ROLE' a line, ROLE submit or admin");
  app.add_flag("--insecure-listen", access.allows_insecure_listen,
               "Listen where other machines can connect without TLS or without knowing who calls: only behind a proxy "
               "that does both");
}

void declare_options(CLI::App& app, OptionList& options, ServerConfig& config) {
  BakeServerOptions& server = config.server;
  options.add("--listen", server.listen, address(true), "HOST:PORT (port 0: any free one) or unix:PATH");
  options.add("--admin-listen", server.admin_listen, address(false),
              "HOST:PORT for /metrics, /livez and /readyz (port 0: any free one); default: none");
  app.add_flag("--admin-open", config.is_admin_port_open,
               "Let --admin-listen name an address that other machines reach: there is no authentication on it");
  options.add("--data", server.data, path_of("a folder"), "Folder for scenes, bakes and results");
  options.add("--costs", server.costs, path_of("a file"),
              "File for what bakes cost on this host, behind predictions; default: DIR/costs.txt");
  options.add("--worker", server.queue.worker.program, path_of("a program"), "The radbake-worker to run");
  options.add("--threads", server.max_threads, whole_number(0, kMaxThreads), "Threads of a bake at most; 0: all cores");
  options.add("--drain-grace", server.drain_grace, seconds(0, 86'400),
              "How long a server that is stopped lets bakes run that will be done by then; the others go back to the "
              "queue at once. With --exit-with-parent the default is 0");
  options.add("--max-attempts", server.queue.max_failed_attempts, whole_number(1, 1'000'000),
              "Workers that may die in a row over a bake that does not get on, until it fails");
  options.add("--max-restarts", server.queue.max_lost_attempts, whole_number(1, 1'000'000),
              "Ends of the server, not in good order, in a row over a bake that does not get on, until it fails");
  options.add("--max-bake-time", server.queue.bake_limit, seconds(0, 366.0 * 86'400),
              "How long an attempt at a bake may take until it fails; 0: as long as it needs");
  options.add("--max-bake-memory-bytes,--max-bake-memory", server.queue.worker.limits.address_space_bytes,
              byte_size(0, 1024 * kTiB), "Address space of a bake's worker; 0: as the machine has");
  declare_access(app, options, server.access);
  declare_limits(options, server.limits);
  app.add_flag("--log-json", config.log.is_json, "Log JSON lines instead of text");
  options.add("--log-level", config.log.level, one_of({"trace", "debug", "info", "warning", "error", "off"}),
              "The least level that is logged");
  app.add_flag("--exit-with-parent", config.is_bound_to_parent, "Stop when the process that started this one ends")
      ->configurable(false);
}

void describe_program(CLI::App& app) {
  app.set_version_flag("--version", std::string("radbaked ") + kEngineVersion)->configurable(false);
  app.get_help_ptr()->configurable(false);
  app.set_config("--config", "", "Read options from a file: one key=value a line")->type_name("FILE");
  app.get_config_ptr()->configurable(false);
  app.footer(
      "Examples:\n"
      "  radbaked                                     on 127.0.0.1:7419\n"
      "  radbaked --listen 127.0.0.1:0 --data /tmp/r  on a free port, which it prints\n"
      "  radbaked --listen unix:/run/radbake.sock --max-running 2 --threads 8 --log-json\n"
      "  radbaked --print-config > radbaked.conf      a file for --config, with every key\n"
      "  radbaked --listen 0.0.0.0:7419 --tls-cert server.pem --tls-key server.key --tls-client-ca clients.pem\n"
      "  head -c 32 /dev/urandom | base64 | tee token | radbaked --hash-token   makes a token for --tokens\n"
      "\n"
      "Prints 'radbaked VERSION listening on ADDRESS' when it is ready, and with --admin-listen 'radbaked VERSION\n"
      "admin on ADDRESS' below it; logs go to stderr. SIGTERM or Ctrl-C stops it: bakes that are nearly done end, the\n"
      "others go back to the queue and run again at the next start. Where other machines can connect, --listen needs\n"
      "TLS and certificates or tokens of clients; the files of both may change while it runs.");
}

Error contradiction(const std::string& key, const std::string& value, const std::string& expected) {
  return invalid_argument(key + " is '" + value + "': expected " + expected);
}

/// Whether two addresses cannot both be listened on.
bool collide(const access::AddressText& one, const access::AddressText& other) {
  if (!other.path.empty() || one.port == 0 || one.port != other.port) return false;
  const auto is_any = [](const std::string& host) { return host == "0.0.0.0" || host == "::"; };
  const bool are_local = is_local(one).value_or(false) && is_local(other).value_or(false);
  return one.host == other.host || is_any(one.host) || is_any(other.host) || are_local;
}

Result<void> check_admin_port(const ServerConfig& config) {
  const BakeServerOptions& server = config.server;
  if (server.admin_listen.empty()) return {};
  const auto admin = access::read_address(server.admin_listen), main = access::read_address(server.listen);
  if (collide(*admin, *main)) {
    return contradiction("admin-listen", server.admin_listen, "another port than listen, which is " + server.listen);
  }
  if (!is_local(*admin).value_or(false) && !config.is_admin_port_open) {
    return contradiction("admin-listen", server.admin_listen,
                         "an address of the loopback, unless admin-open=true says that others may reach it");
  }
  return {};
}

/// Values that are good alone and not together.
Result<void> check_together(const ServerConfig& config) {
  const BakeServerOptions& server = config.server;
  const Limits& limits = server.limits;
  if (limits.chunk_bytes + kChunkOverheadBytes > limits.max_message_bytes) {
    return contradiction("chunk-bytes", write_bytes(limits.chunk_bytes),
                         "at most max-message-bytes, which is " + write_bytes(limits.max_message_bytes) + ", less " +
                             write_bytes(kChunkOverheadBytes));
  }
  if (limits.max_manifest_bytes > limits.max_blob_bytes) {
    return contradiction("max-manifest-bytes", write_bytes(limits.max_manifest_bytes),
                         "at most max-blob-bytes, which is " + write_bytes(limits.max_blob_bytes));
  }
  if (limits.min_atlas_size > limits.max_atlas_size) {
    return contradiction("min-atlas-size", std::to_string(limits.min_atlas_size),
                         "at most max-atlas-size, which is " + std::to_string(limits.max_atlas_size));
  }
  RADBAKE_RETURN_IF_ERROR(check_admin_port(config));
  // What a name stands for shows at the start, which checks once more.
  const bool may_be_local = is_local(*access::read_address(server.listen)).value_or(true);
  return access::check_access(server.access, server.listen, may_be_local);
}

/// CLI11's message as one line.
std::string in_one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

Result<ParsedConfig> parse_config(const std::vector<std::string>& arguments) {
  ParsedConfig parsed;
  ServerConfig& config = parsed.config;
  config.server.data = default_data_folder();
  config.server.queue.worker.program = default_worker();
  config.server.queue.keeps_worker_ready = true;
  config.server.drain_grace = kDrainGrace;

  CLI::App app("The baking server of radbake: stores scenes, bakes them in worker processes, keeps the results.",
               "radbaked");
  const auto file = std::make_shared<ConfigFile>(app);
  app.config_formatter(file);
  describe_program(app);
  OptionList options(app, file);
  declare_options(app, options, config);
  bool prints_config = false;
  app.add_flag("--hash-token", parsed.hashes_token, "Read a token from stdin, print its hash for --tokens, and end")
      ->configurable(false);
  app.add_flag("--print-config", prints_config, "Print the configuration as it would be used, and end")
      ->configurable(false);
  try {
    // CLI11 takes the last one first.
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    parsed.answer = app.help();
    return parsed;
  } catch (const CLI::CallForVersion& version) {
    parsed.answer = std::string(version.what()) + "\n";
    return parsed;
  } catch (const CLI::FileError& problem) {
    return contradiction("config", app.get_config_ptr()->as<std::string>(), "a file that can be read");
  } catch (const CLI::ParseError& problem) {
    return invalid_argument(in_one_line(problem.what()));
  }
  if (config.is_bound_to_parent && app.get_option("--drain-grace")->count() == 0) config.server.drain_grace = {};
  RADBAKE_RETURN_IF_ERROR(check_together(config));
  if (prints_config) parsed.answer = app.config_to_str(true, true);
  return parsed;
}

Result<void> check_host(const ServerConfig& config) {
  const std::filesystem::path& data = config.server.data;
  std::error_code reason;
  std::filesystem::create_directories(data, reason);
  const bool is_folder = !reason && std::filesystem::is_directory(data, reason);
  if (!is_folder || ::access(data.c_str(), W_OK | X_OK) != 0) {
    const std::string why = reason ? reason.message() : is_folder ? "not writable" : "not a folder";
    return Error{ErrorCode::kFailedPrecondition,
                 "data is '" + data.string() + "' (" + why + "): expected a folder that radbaked may write to"};
  }
  const std::filesystem::path& worker = config.server.queue.worker.program;
  if (::access(worker.c_str(), X_OK) != 0) {
    return Error{ErrorCode::kFailedPrecondition,
                 "worker is '" + worker.string() + "': expected the radbake-worker program, which is not there"};
  }
  return {};
}

}  // namespace radbake::service

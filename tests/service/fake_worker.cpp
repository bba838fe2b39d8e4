// A worker that bakes nothing and misbehaves on demand: the other side of radbake.v1.Workers for the server's tests.

#include "tests/service/fake_worker.h"

#include <dirent.h>
#include <fcntl.h>
#include <grpc/grpc.h>
#include <grpcpp/create_channel_posix.h>
#include <grpcpp/grpcpp.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "common/base/digest.h"
#include "common/base/version.h"
#include "radbake/v1/worker.grpc.pb.h"
#include "server/handover/handover.h"
#include "server/worker/sandbox.h"

namespace radbake::testing {
namespace {

using namespace std::chrono_literals;
using Stream = grpc::ClientReaderWriter<v1::WorkerReport, v1::WorkerCommand>;

class FakeWorker {
 public:
  FakeWorker(Stream& stream, std::string job, unsigned attempt, std::vector<int> handed)
      : stream_(stream), job_(std::move(job)), attempt_(attempt), handed_(std::move(handed)) {}

  void greet(const std::string& program) {
    v1::WorkerReport report;
    v1::WorkerHello& hello = *report.mutable_hello();
    hello.set_job(job_);
    hello.set_attempt(program == kWrongAttemptName ? attempt_ + 1 : attempt_);
    hello.set_engine_version(program == kWrongVersionName ? "0.0.0" : kEngineVersion);
    hello.set_protocol_major(kProtocolMajor);
    stream_.Write(report);
  }

  void work() {
    v1::WorkerCommand command;
    if (!stream_.Read(&command) || !command.has_start()) _exit(8);
    start_ = command.start();
    reader_ = std::thread([this] { read_commands(); });
    do_work(static_cast<FakeWork>(start_.settings().seed()));
    reader_.join();  // ends when the server has accepted, or is gone
  }

 private:
  void read_commands() {
    v1::WorkerCommand command;
    while (stream_.Read(&command)) {
      if (command.has_cancel()) is_cancelled_ = true;
      if (command.has_finish()) is_finishing_ = true;
      if (command.has_accepted()) return;
    }
    _exit(9);
  }

  void do_work(FakeWork work) {
    if (work >= kStartProcess && !worker::enter_sandbox().ok()) _exit(5);
    report_progress(v1::PREPARING, 0.1);
    switch (work) {
      case kSucceed: return succeed();
      case kFailBadScene: return fail(grpc::INVALID_ARGUMENT, "mesh 'box': vertex 3 is not finite");
      case kCrash: raise(SIGSEGV); return;
      case kExitWithMessage: std::cerr << kLastWords << std::endl; _exit(7);
      case kHang: std::this_thread::sleep_for(1h); return;
      case kNearlyDone: seconds_left_ = kFakeSecondsLeft; return run(true);
      case kRunUntilCancelled: return run(true);
      case kIgnoreCancel: return run(false);
      case kSendWrongDigest: return send_layer(std::string("not these bytes")), finish_bake();
      case kNameUnsentBlob: layer_.digest = digest_of(std::string("never sent")); return finish_bake();
      case kListDescriptors: return fail(grpc::INVALID_ARGUMENT, list_descriptors());
      case kSucceedSecondTime: return attempt_ == 1 ? run(true) : succeed();
      case kDieAfterTiles: return attempt_ == 1 ? die_after_tiles() : succeed();
      case kReadInputs: return fail(grpc::INVALID_ARGUMENT, read_inputs());
      // What breaks out does not get to its outcome.
      case kStartProcess: fork(); return succeed();
      case kRunProgram: execl("/bin/true", "true", nullptr); return succeed();
      case kOpenSocket: socket(AF_INET, SOCK_STREAM, 0); return succeed();
      case kWriteFile: open("/tmp/radbake-fake-worker", O_WRONLY | O_CREAT, 0600); return succeed();
      case kReadFile:
        return fail(grpc::INVALID_ARGUMENT, open("/etc/passwd", O_RDONLY) < 0 ? std::strerror(errno) : "opened");
    }
    fail(grpc::INTERNAL, "unknown fake work " + std::to_string(work));
  }

  void succeed() {
    if (start_.plan_only()) {
      v1::WorkerReport report;
      v1::Plan& plan = *report.mutable_plan_finished();
      plan.set_num_patches(kFakePatches);
      // Says what it was told of costs.
      plan.mutable_prediction()->mutable_total()->set_cpu_seconds(start_.costs().row_ray());
      stream_.Write(report);
      return;
    }
    report_progress(v1::FORM_FACTORS, 0.2);
    report_progress(v1::SOLVING, 0.4);
    report_progress(v1::GATHERING, 0.5);
    const auto num_tiles = static_cast<unsigned>(start_.settings().transport_memory_bytes());
    std::string plane;
    for (unsigned i = 0; i < num_tiles; ++i) plane += send_tile(i, num_tiles);
    report_progress(v1::WRITING, 0.9);
    layer_.digest = digest_of(plane);
    layer_.height = num_tiles * kTileSize;
    send_layer(plane);
    finish_bake();
  }

  void run(bool obeys) {
    while (!(obeys && (is_cancelled_ || is_finishing_))) {
      report_progress(v1::FORM_FACTORS, 0.3);
      std::this_thread::sleep_for(10ms);
    }
    if (!is_cancelled_) return succeed();
    v1::WorkerReport report;
    report.mutable_cancelled()->set_code(grpc::CANCELLED);
    stream_.Write(report);
  }

  void die_after_tiles() {
    const auto num_tiles = static_cast<unsigned>(start_.settings().transport_memory_bytes());
    for (unsigned i = 0; i < num_tiles / 2; ++i) send_tile(i, num_tiles);
    while (!is_finishing_) {
      report_progress(v1::GATHERING, 0.5);
      std::this_thread::sleep_for(10ms);
    }
    raise(SIGSEGV);
  }

  void report_progress(v1::BakeState state, double fraction) {
    v1::WorkerReport report;
    report.mutable_progress()->set_state(state);
    report.mutable_progress()->set_fraction(fraction);
    report.mutable_progress()->set_seconds_left(seconds_left_);
    report.mutable_progress()->set_pass(kFakePass);
    report.mutable_progress()->set_relative_error(kFakeError);
    report.mutable_progress()->set_relative_error_low(kFakeErrorLow);
    report.mutable_progress()->set_relative_error_high(kFakeErrorHigh);
    report.mutable_progress()->set_asked_error(start_.settings().max_error());
    stream_.Write(report);
  }

  std::string send_tile(unsigned index, unsigned num_tiles) {
    v1::WorkerReport report;
    v1::LayerTile& tile = *report.mutable_tile();
    tile.set_layer_name("lightmap_0");
    tile.set_layer_width(kTileSize);
    tile.set_layer_height(num_tiles * kTileSize);
    tile.set_channels(kFakeChannels);
    tile.set_y(index * kTileSize);
    tile.set_width(kTileSize);
    tile.set_height(kTileSize);
    const std::vector<float> values(kTileSize * kTileSize * kFakeChannels, static_cast<float>(index));
    tile.set_data(std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)));
    stream_.Write(report);
    return tile.data();
  }

  void send_layer(const std::string& plane) {
    constexpr std::size_t kChunk = 128 << 10;
    if (layer_.digest.sha256.empty()) layer_.digest = digest_of(std::string("a claim"));
    for (std::size_t offset = 0; offset == 0 || offset < plane.size(); offset += kChunk) {
      v1::WorkerReport report;
      v1::ResultBlobChunk& chunk = *report.mutable_chunk();
      chunk.set_blob("lightmap_0");
      chunk.set_offset(offset);
      chunk.set_data(plane.substr(offset, kChunk));
      chunk.set_finish(offset + kChunk >= plane.size());
      if (chunk.finish()) set_digest(*chunk.mutable_digest());
      stream_.Write(report);
    }
  }

  void finish_bake() {
    v1::WorkerReport report;
    v1::Layer& layer = *report.mutable_bake_finished()->add_layers();
    layer.set_name("lightmap_0");
    layer.set_width(kTileSize);
    layer.set_height(layer_.height);
    layer.set_channels(kFakeChannels);
    set_digest(*layer.mutable_blob());
    report.mutable_bake_finished()->mutable_report()->set_num_gather_rays(kFakeRays);
    v1::RunReport& run = *report.mutable_bake_finished()->mutable_report()->mutable_run();
    run.set_rays_per_second(kFakeRaysPerSecond);
    run.mutable_costs()->set_row_ray(kFakeRayCost);
    // Says how long it was told that the bake had waited.
    run.set_wall_seconds(start_.waited_seconds());
    stream_.Write(report);
  }

  void fail(int code, const std::string& message) {
    v1::WorkerReport report;
    report.mutable_failed()->set_code(code);
    report.mutable_failed()->set_message(message);
    stream_.Write(report);
  }

  void set_digest(v1::Digest& digest) const {
    digest.set_sha256(layer_.digest.sha256);
    digest.set_size_bytes(layer_.digest.size_bytes);
  }

  // Sockets and files, as "S" and "F", beyond the three standard ones. gRPC's own (eventfd, epoll) are neither.
  static std::string list_descriptors() {
    std::string kinds;
    for (int fd = 3; fd < 1024; ++fd) {
      struct stat facts {};
      if (fstat(fd, &facts) != 0) continue;
      if (S_ISSOCK(facts.st_mode)) kinds += 'S';
      if (S_ISREG(facts.st_mode)) kinds += 'F';
    }
    return kinds;
  }

  std::string read_inputs() const {
    std::string report;
    for (int i = 0; i < start_.inputs_size(); ++i) {
      const v1::InputBlob& input = start_.inputs(i);
      const int fd = handed_.empty() ? input.fd() : handed_.at(static_cast<std::size_t>(i));
      std::string bytes(input.digest().size_bytes() + 1, '\0');
      const ssize_t size = pread(fd, bytes.data(), bytes.size(), 0);
      bytes.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
      const bool is_equal = digest_of(bytes).sha256 == input.digest().sha256();
      const bool is_read_only = (fcntl(fd, F_GETFL) & O_ACCMODE) == O_RDONLY;
      report += is_equal && is_read_only ? "good " : "bad ";
    }
    return report;
  }

  struct {
    Digest digest;
    unsigned height = 0;
  } layer_;
  Stream& stream_;
  const std::string job_;
  const unsigned attempt_;
  const std::vector<int> handed_;  // inputs of a worker that was started ahead of need
  v1::StartWork start_;
  double seconds_left_ = -1;  // not known
  std::atomic<bool> is_cancelled_ = false, is_finishing_ = false;
  std::thread reader_;
};

}  // namespace
}  // namespace radbake::testing

int main(int argc, char** argv) {
  signal(SIGSEGV, SIG_DFL);  // also where a sanitizer would report it
  using namespace radbake::testing;
  std::string program = argv[0];
  program = program.substr(program.rfind('/') + 1);
  int fd = -1;
  std::string job;
  unsigned attempt = 0;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--fd") == 0) fd = std::atoi(argv[i + 1]);
    if (std::strcmp(argv[i], "--job") == 0) job = argv[i + 1];
    if (std::strcmp(argv[i], "--attempt") == 0) attempt = static_cast<unsigned>(std::atoi(argv[i + 1]));
  }
  std::vector<int> handed;
  if (std::strcmp(argv[argc - 1], "--wait") == 0) {
    if (program == kDeadWhileReadyName) return 1;
    if (!radbake::handover::announce(fd).ok()) return 3;
    auto assignment = radbake::handover::take(fd);
    if (!assignment.ok()) return 3;
    job = assignment->job;
    attempt = assignment->attempt;
    handed = assignment->inputs;
    std::cerr << kReadyWords << std::endl;
  }
  if (fd < 0 || job.empty() || attempt == 0) return 2;
  if (program == kMuteName) std::this_thread::sleep_for(std::chrono::hours(1));

  grpc_init();  // never paid back: the library's own shutdown may take 10 s
  const auto stub = radbake::v1::Workers::NewStub(grpc::CreateInsecureChannelFromFd("server", fd));
  grpc::ClientContext context;
  const auto stream = stub->Report(&context);
  FakeWorker worker(*stream, job, attempt, handed);
  worker.greet(program);
  worker.work();
  // As a real worker does: a clean end once everything is accepted.
  stream->WritesDone();
  return stream->Finish().ok() ? 0 : 6;
}

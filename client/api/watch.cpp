#include "client/api/connection.h"

namespace radbake::api {

Result<v1::Bake> Client::watch(const std::string& name, const WatchOptions& options, const WatchCallback& callback,
                               std::stop_token stop) {
  v1::WatchBakeRequest request;
  request.set_name(name);
  request.set_after_sequence(options.after_sequence);
  request.set_include_tiles(options.include_tiles);
  Backoff backoff(connection_->options, connection_->options.stream_patience);
  while (true) {
    Call call(*connection_, stop);
    const auto reader = connection_->bakes->WatchBake(&call.context(), request);
    v1::WatchBakeResponse response;
    while (reader->Read(&response)) {
      // A snapshot alone is no progress: a server that breaks each watch after it must not be asked for ever.
      if (!response.has_snapshot()) backoff.reset();
      if (response.has_event()) {
        // An event that was seen before the stream broke is not news.
        if (response.event().sequence() <= request.after_sequence()) continue;
        request.set_after_sequence(response.event().sequence());
      }
      callback(response);
      if (response.has_finished()) {
        v1::Bake finished = std::move(*response.mutable_finished());
        abandon(call, *reader);
        return finished;
      }
    }
    const grpc::Status status = reader->Finish();
    if (stop.stop_requested()) return stopped();

    // A stream that ends well without the last message is a server that shuts down.
    Error error{ErrorCode::kUnavailable, "server " + connection_->address + " ended the watch of " + name};
    if (!status.ok()) error = connection_->describe(status);
    if (error.code != ErrorCode::kUnavailable || !backoff.wait(stop)) return stop.stop_requested() ? stopped() : error;
  }
}

}  // namespace radbake::api

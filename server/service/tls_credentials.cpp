#include "server/service/tls_credentials.h"

#include <grpc/grpc.h>
#include <grpc/grpc_security.h>

#include <string>
#include <utility>

#include "server/access/reloaded.h"
#include "server/access/tls_files.h"

namespace radbake::service {
namespace {

using TlsMaterial = access::Reloaded<access::TlsMaterial>;

/// TLS by gRPC's C interface, whose certificates come from a callback at each handshake. Its C++ wrapper has that only
/// as an experiment that polls the files, does not check that they go together, and may take a key and a certificate of
/// different times.
class TlsCredentials : public grpc::ServerCredentials {
 public:
  TlsCredentials(std::unique_ptr<TlsMaterial> material, grpc_ssl_client_certificate_request_type request)
      : material_(std::move(material)),
        credentials_(grpc_ssl_server_credentials_create_with_options(
            grpc_ssl_server_credentials_create_options_using_config_fetcher(request, &TlsCredentials::fetch, this))) {}
  ~TlsCredentials() override { grpc_server_credentials_release(credentials_); }

  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) override {}

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    return grpc_server_add_http2_port(server, address.c_str(), credentials_);
  }

  /// Called at each handshake.
  static grpc_ssl_certificate_config_reload_status fetch(void* self, grpc_ssl_server_certificate_config** config) {
    return static_cast<TlsCredentials*>(self)->fetch(config);
  }

  grpc_ssl_certificate_config_reload_status fetch(grpc_ssl_server_certificate_config** config) {
    const std::lock_guard lock(mutex_);
    auto now = material_->current();
    if (now == in_force_) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
    const grpc_ssl_pem_key_cert_pair pair{now->key.c_str(), now->certificate.c_str()};
    // gRPC insists on authorities, also where no client is asked for its certificate and they count for nothing.
    const std::string& authorities = now->client_ca.empty() ? now->certificate : now->client_ca;
    *config = grpc_ssl_server_certificate_config_create(authorities.c_str(), &pair, 1);
    in_force_ = std::move(now);
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
  }

  const std::unique_ptr<TlsMaterial> material_;
  std::mutex mutex_;  // guards what follows
  std::shared_ptr<const access::TlsMaterial> in_force_;
  grpc_server_credentials* const credentials_;
};

}  // namespace

Result<std::shared_ptr<grpc::ServerCredentials>> make_credentials(const access::AccessOptions& options) {
  if (!options.has_tls()) return grpc::InsecureServerCredentials();
  const access::TlsFiles& files = options.tls;
  TlsMaterial::Files watched = {files.certificate, files.key};
  if (!files.client_ca.empty()) watched.push_back(files.client_ca);
  RADBAKE_ASSIGN_OR_RETURN(auto material,
                           TlsMaterial::open(std::move(watched), [files] { return access::read_tls_files(files); }));
  grpc_ssl_client_certificate_request_type request = GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE;
  if (!files.client_ca.empty()) {
    request = options.tokens.empty() ? GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY
                                     : GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY;
  }
  return std::shared_ptr<grpc::ServerCredentials>(std::make_shared<TlsCredentials>(std::move(material), request));
}

}  // namespace radbake::service

#include "common/pipeline/bus/secured/participant_security.h"

#include <dds/security/dds_security_api_defs.h>

#include <filesystem>
#include <string>

#include "common/pipeline/security/plugins.h"

namespace fivepipe::bus::detail {

void set_security(dds_qos_t* qos, const security::RoleFiles& files) {
  const auto set_plugin = [&](const char* path, const char* init, const char* finalize,
                              const std::string& library, const std::string& function) {
    dds_qset_prop(qos, path, security::plugin_library(library).c_str());
    dds_qset_prop(qos, init, ("init_" + function).c_str());
    dds_qset_prop(qos, finalize, ("finalize_" + function).c_str());
  };
  set_plugin(DDS_SEC_PROP_AUTH_LIBRARY_PATH, DDS_SEC_PROP_AUTH_LIBRARY_INIT,
             DDS_SEC_PROP_AUTH_LIBRARY_FINALIZE, "auth", "authentication");
  set_plugin(DDS_SEC_PROP_ACCESS_LIBRARY_PATH, DDS_SEC_PROP_ACCESS_LIBRARY_INIT,
             DDS_SEC_PROP_ACCESS_LIBRARY_FINALIZE, "ac", "access_control");
  set_plugin(DDS_SEC_PROP_CRYPTO_LIBRARY_PATH, DDS_SEC_PROP_CRYPTO_LIBRARY_INIT,
             DDS_SEC_PROP_CRYPTO_LIBRARY_FINALIZE, "crypto", "crypto");
  const auto set_file = [&](const char* property, const std::filesystem::path& file) {
    dds_qset_prop(qos, property, ("file:" + std::filesystem::absolute(file).string()).c_str());
  };
  set_file(DDS_SEC_PROP_AUTH_IDENTITY_CA, files.ca());
  set_file(DDS_SEC_PROP_AUTH_IDENTITY_CERT, files.identity());
  set_file(DDS_SEC_PROP_AUTH_PRIV_KEY, files.key());
  set_file(DDS_SEC_PROP_ACCESS_PERMISSIONS_CA, files.permissions_ca());
  set_file(DDS_SEC_PROP_ACCESS_GOVERNANCE, files.governance());
  set_file(DDS_SEC_PROP_ACCESS_PERMISSIONS, files.permissions());
}

}  // namespace fivepipe::bus::detail

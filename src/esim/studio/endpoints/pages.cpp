#include <fstream>
#include <iterator>

#include "esim/studio/endpoints/endpoints.h"

namespace esim::studio {

void add_pages(Router& router, const std::filesystem::path& folder) {
  router.add_rest([page = Roots({folder})](const Request& request) {
    const std::string& root = page.list().front().name;
    const std::filesystem::path file = page.existing(root + (request.path == "/" ? "/index.html" : request.path));
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) throw HttpError(404, request.path + ": no such address");
    std::ifstream stream(file, std::ios::binary);
    Response response;
    response.content_type = content_type_of(file.filename().string());
    response.headers = {{"Cache-Control", "no-cache"}};
    response.body.assign(std::istreambuf_iterator<char>(stream), {});
    return response;
  });
}

}  // namespace esim::studio

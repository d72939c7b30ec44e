# Writes the files of SHADERS into the C++ source OUTPUT that defines what shader_sources.h declares: `terrain.vert` becomes
# the std::string_view scree::shader_source::terrain_vert.
set(content "#include \"runtime/render/shader_sources.h\"\n\nnamespace scree::shader_source {\n\n")
foreach(shader IN LISTS SHADERS)
    file(READ "${shader}" text)
    get_filename_component(name "${shader}" NAME)
    string(REPLACE "." "_" name "${name}")
    string(REGEX REPLACE "_glsl$" "" name "${name}")
    string(APPEND content "const std::string_view ${name} = R\"glsl(${text})glsl\";\n\n")
endforeach()
string(APPEND content "}  // namespace scree::shader_source\n")
file(WRITE "${OUTPUT}" "${content}")

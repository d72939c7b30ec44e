# The library as others use it (docs/library.md): three archives, their headers, and what find_package(scree) reads.

# Headers that a user may include; names are relative to the folder of the caller.
function(scree_public_headers)
    foreach(header IN LISTS ARGN)
        file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/${header})
        set_property(GLOBAL APPEND PROPERTY SCREE_PUBLIC_HEADERS ${path})
    endforeach()
endfunction()

# scree::NAME, one archive of the objects of several rooms, without the flags that are our own affair.
function(scree_archive name)
    cmake_parse_arguments(PARSE_ARGV 1 archive "" "" "ROOMS;PUBLIC;PRIVATE")
    list(TRANSFORM archive_ROOMS REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>")
    set(target scree_archive_${name})
    add_library(${target} STATIC ${archive_ROOMS})
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} OUTPUT_NAME scree_${name} LINKER_LANGUAGE CXX
                                               ARCHIVE_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/library)
    target_include_directories(${target} INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    target_compile_features(${target} INTERFACE cxx_std_20)
    target_link_libraries(${target} PUBLIC ${archive_PUBLIC} PRIVATE ${archive_PRIVATE})
    install(TARGETS ${target} EXPORT scree_targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
endfunction()

function(scree_install_library)
    get_property(headers GLOBAL PROPERTY SCREE_PUBLIC_HEADERS)
    set(out ${PROJECT_BINARY_DIR}/public_headers)
    list(TRANSFORM headers PREPEND ${PROJECT_SOURCE_DIR}/ OUTPUT_VARIABLE paths)
    add_custom_command(
        OUTPUT ${out}.stamp
        COMMAND ${CMAKE_COMMAND} -D SOURCE=${PROJECT_SOURCE_DIR} -D OUTPUT=${out}/scree -D "HEADERS=${headers}" -P
                ${PROJECT_SOURCE_DIR}/cmake/public_headers.cmake
        COMMAND ${CMAKE_COMMAND} -E touch ${out}.stamp
        DEPENDS ${paths} ${PROJECT_SOURCE_DIR}/cmake/public_headers.cmake
        COMMENT "Writing public headers"
        VERBATIM)
    add_custom_target(scree_public_headers ALL DEPENDS ${out}.stamp)
    install(DIRECTORY ${out}/scree DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev)

    include(CMakePackageConfigHelpers)
    set(place ${CMAKE_INSTALL_LIBDIR}/cmake/scree)
    configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/screeConfig.cmake.in ${PROJECT_BINARY_DIR}/screeConfig.cmake
                                  INSTALL_DESTINATION ${place})
    write_basic_package_version_file(${PROJECT_BINARY_DIR}/screeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
    install(FILES ${PROJECT_BINARY_DIR}/screeConfig.cmake ${PROJECT_BINARY_DIR}/screeConfigVersion.cmake
            DESTINATION ${place} COMPONENT dev)
    install(EXPORT scree_targets NAMESPACE scree:: FILE screeTargets.cmake DESTINATION ${place} COMPONENT dev)
    file(RELATIVE_PATH prefix_from_pc /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
    configure_file(${PROJECT_SOURCE_DIR}/cmake/scree.pc.in ${PROJECT_BINARY_DIR}/scree.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/scree.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endfunction()

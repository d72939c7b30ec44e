# Manual pages and completion (bash, zsh, fish) of a program, written by the program itself from what its --help says.
find_program(SCREE_GZIP gzip REQUIRED)

function(scree_documentation program)
    set(out ${PROJECT_BINARY_DIR}/documentation)
    set(pages ${program}.1)
    set(commands COMMAND $<TARGET_FILE:${program}> --man-page > ${program}.1
                 COMMAND $<TARGET_FILE:${program}> --completion > ${program}
                 COMMAND $<TARGET_FILE:${program}> --completion-zsh > _${program}
                 COMMAND $<TARGET_FILE:${program}> --completion-fish > ${program}.fish)
    foreach(command IN LISTS ARGN)
        list(APPEND pages ${program}-${command}.1)
        list(APPEND commands COMMAND $<TARGET_FILE:${program}> ${command} --man-page > ${program}-${command}.1)
    endforeach()
    # Without name and time: the same bytes from every build.
    list(TRANSFORM pages APPEND .gz OUTPUT_VARIABLE files)
    list(TRANSFORM files PREPEND ${out}/)
    file(MAKE_DIRECTORY ${out})
    add_custom_command(
        OUTPUT ${files} ${out}/${program} ${out}/_${program} ${out}/${program}.fish
        ${commands}
        COMMAND ${SCREE_GZIP} -9nkf ${pages}
        DEPENDS ${program}
        WORKING_DIRECTORY ${out}
        COMMENT "Writing the manual pages of ${program}"
        VERBATIM)
    add_custom_target(${program}-documentation ALL DEPENDS ${files} ${out}/${program})
    install(FILES ${files} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT ${program})
    install(FILES ${out}/_${program} DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT ${program})
    install(FILES ${out}/${program}.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT ${program})
    install(FILES ${out}/${program} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT ${program})
endfunction()

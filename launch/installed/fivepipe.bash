# Completion of fivepipe in bash: subcommands and options are read from --help, so they are always
# those of the installed program.
_fivepipe() {
  local word=${COMP_WORDS[COMP_CWORD]} program=${COMP_WORDS[0]} words
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    words=$("$program" --help 2>/dev/null | sed -n '/^Subcommands:/,$s/^  \([a-z]\{2,\}\) .*/\1/p')
    mapfile -t COMPREPLY < <(compgen -W "$words --help --version" -- "$word")
    return
  fi
  local command=("${COMP_WORDS[1]}")
  # Each suite of `bench` is a program of its own, and `study` has subcommands.
  if [[ ${COMP_WORDS[1]} == @(bench|study) ]] && [ "$COMP_CWORD" -gt 2 ]; then
    command+=("${COMP_WORDS[2]}")
  fi
  if [[ $word == -* ]]; then
    words=$("$program" "${command[@]}" --help 2>/dev/null | grep -oE '^ +(-[a-z],)?--[a-z-]+' |
      grep -oE -- '--[a-z-]+')
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
    return
  fi
  # The names of hosts are in the deployment file.
  if [ "${COMP_WORDS[COMP_CWORD - 1]}" = --host ]; then return; fi
  if [ "$COMP_CWORD" -eq 2 ]; then
    case ${COMP_WORDS[1]} in
      study) words=$("$program" study --help 2>/dev/null |
        sed -n '/^Subcommands:/,/^Examples:/s/^  \([a-z-]\{2,\}\) .*/\1/p') ;;
      bench) words="pipeline compare $("$program" bench 2>&1 |
        sed -n '/suites: none/d; s/^  suites: //p' | tr -d ,)" ;;
      simulation) words=$("$program" simulation --help 2>/dev/null |
        sed -n 's/.*{\([a-z,]*\)}.*/\1/p' | head -1 | tr , ' ') ;;
      *) words= ;;
    esac
    if [ -n "$words" ]; then
      mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
      return
    fi
  fi
  if [ "${COMP_WORDS[1]}" = up ] || [ "${COMP_WORDS[COMP_CWORD - 1]}" = --deployment ]; then
    local folder
    folder=$(dirname "$(readlink -f "$(type -P "$program")")")
    words=$(find "$folder/../../share/fivepipe/launch/deployments" -name '*.yaml' \
      -exec basename {} .yaml \; 2>/dev/null)
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
  fi
  local file
  while IFS= read -r file; do COMPREPLY+=("$file"); done < <(compgen -f -- "$word")
}
complete -o filenames -F _fivepipe fivepipe

# Completes command lines of catoptric in bash. Made by `catoptric list --completion bash`; do not edit.
_catoptric() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]}
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "render plan info list doctor merge submit status retry cancel compare figure layers sweep tables tune nightly worker --help --version" -- "$word"))
    return
  fi
  case $before in
    --completion) COMPREPLY=($(compgen -W "bash zsh" -- "$word")); return ;;
    --device) COMPREPLY=($(compgen -W "auto surfaceless osmesa" -- "$word")); return ;;
    --existing) COMPREPLY=($(compgen -W "error overwrite resume" -- "$word")); return ;;
    --method) COMPREPLY=($(compgen -W "$(catoptric list methods 2>/dev/null | sed 's/ .*//')" -- "$word")); return ;;
    --progress) COMPREPLY=($(compgen -W "auto bar plain json none" -- "$word")); return ;;
    --schema) COMPREPLY=($(compgen -W "run scene path suite nightly" -- "$word")); return ;;
    --set) compopt -o nospace; COMPREPLY=($(compgen -W "$(catoptric list options 2>/dev/null | sed 's/ .*/=/')" -- "$word")); return ;;
    --to) COMPREPLY=($(compgen -W "slurm script" -- "$word")); return ;;
    --vary) compopt -o nospace; COMPREPLY=($(compgen -W "$(catoptric list options 2>/dev/null | sed 's/ .*/=/')" -- "$word")); return ;;
  esac
  local options=
  case $command in
    render) options="--help --frames --camera --environment --asset-path --ground --method --set --device --threads --seed --json --quiet --verbose --shader-dir --out --existing --chunk --keep-going --video --ocio --view --no-tables --wait --stop-within --dry-run --progress --repeats --ratio-to --amortize" ;;
    plan) options="--help --frames --camera --environment --asset-path --ground --method --set --device --threads --seed --json --quiet --verbose --shader-dir" ;;
    info) options="--help --environment --asset-path --ground --json --quiet --verbose" ;;
    list) options="--help --schema --markdown --man --completion --json --quiet --verbose" ;;
    doctor) options="--help --json --quiet --verbose" ;;
    merge) options="--help --out --existing --json --quiet --verbose" ;;
    submit) options="--help --frames --camera --environment --asset-path --ground --method --set --device --threads --seed --json --quiet --verbose --shader-dir --out --to --chunks --task-minutes --times --max-parallel --sbatch --dry-run" ;;
    status) options="--help --wait --verify --json --quiet --verbose" ;;
    retry) options="--help --verify --dry-run --json --quiet --verbose" ;;
    cancel) options="--help --json --quiet --verbose" ;;
    compare) options="--help --out --video --fail --fail-percent --hard-fail --max-mean --max-l1 --start-exposure --stop-exposure --num-exposures --ppd --json --quiet --verbose" ;;
    figure) options="--help --out --frame --crop --zoom --width --layer --mask --against --difference --labels --title --columns --json --quiet --verbose" ;;
    layers) options="--help --out --layer --json --quiet --verbose" ;;
    sweep) options="--help --frames --camera --environment --asset-path --ground --method --set --device --threads --seed --json --quiet --verbose --shader-dir --out --against --repeats --workers --patience --budget --existing --clock --progress --time --amortize --vary --link --where --metric --ratio-to --keep-frames --dry-run" ;;
    tables) options="--help --out --effort --only --format --repeats --workers --patience --amortize --text-only --into --values --pictures --check --progress --json --quiet --verbose" ;;
    tune) options="--help --frames --camera --environment --asset-path --ground --method --set --device --threads --seed --json --quiet --verbose --shader-dir --out --against --repeats --workers --patience --budget --existing --clock --progress --time --amortize --max-error --max-time --vary --per-reflector --verify --test-path --margin --dry-run" ;;
    nightly) options="--help --history --effort --only --program --baseline --time-gate --repeats --clock --patience --run-only --compare-only --report-only --html --single-file --junit --reason --progress --json --quiet --verbose" ;;
    worker) options="--help --frames --camera --environment --asset-path --ground --method --set --device --threads --seed --json --quiet --verbose --shader-dir" ;;
  esac
  if [[ $word == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$word"))
  elif [ "$command" = list ]; then
    COMPREPLY=($(compgen -W "methods options steps counters layers metrics scenes paths configs shapes devices" -- "$word"))
  else
    compopt -o filenames 2>/dev/null
    COMPREPLY=($(compgen -f -- "$word"))
  fi
}
complete -F _catoptric catoptric

"""usage: emsim completion bash|zsh|fish

Prints a completion script: verbs, their options, files of the right kind, names of methods and templates. To have it always:
bash: `emsim completion bash > ~/.local/share/bash-completion/completions/emsim`
zsh:  `emsim completion zsh > ~/.zfunc/_emsim`, with `fpath+=~/.zfunc; autoload -Uz compinit; compinit` in ~/.zshrc
fish: `emsim completion fish > ~/.config/fish/completions/emsim.fish`"""

from __future__ import annotations

from importlib import import_module

from . import VERBS
from .arguments import HELP, Option, UsageError, parse
from .console import OK, print_lines

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

OPTIONS = [HELP]
SHELLS = ("bash", "zsh", "fish")
DECKS = ("cir", "net", "sp", "spice", "ckt")
FILES = ("FILE", "DIR", "FOLDER")  # what an option's value is called when it is a path


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    if len(given.words) != 1 or given.words[0] not in SHELLS:
        raise UsageError(f"emsim completion takes the name of a shell: {', '.join(SHELLS)}")
    print_lines({"bash": bash, "zsh": zsh, "fish": fish}[given.words[0]]())
    return OK


def options_of(verb: str) -> list[Option]:
    return list(getattr(import_module("." + verb, __package__), "OPTIONS", ()))


def words_of(verb: str) -> list[str] | None:
    """What may stand where a verb has its words; None for files, see `extensions_of`."""
    if verb == "help":
        from ..editor import meanings

        return [*VERBS, *meanings.known()]
    if verb == "completion":
        return list(SHELLS)
    return [] if verb in ("new", "version", "lsp") else None


def extensions_of(verb: str) -> tuple[str, ...]:
    if verb not in ("convert", "plot"):
        return DECKS
    from ..outputs import READERS

    return tuple(extension[1:] for extension in READERS)


def values_of(option: Option) -> list[str] | None:
    """The words that an option may have for a value; None where it has none, [] where nobody knows them."""
    if not option.value:
        return None
    if option.key == "method":
        from ..assemble.options import METHODS

        return list(METHODS)
    if option.key == "template":
        from .new import templates

        return templates()
    return []


# ---- bash ---------------------------------------------------------------------------------------

_BASH = """\
# completion of emsim; written by `emsim completion bash`
_emsim() {
    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} verb=${COMP_WORDS[1]} options= words= files= suffix
    # bash cuts --option=value at the sign
    [[ $cur == = ]] && cur=
    [[ $prev == = ]] && prev=${COMP_WORDS[COMP_CWORD-2]}
    case $verb in
        @VERBS@) ;;
        *) verb=run ;;
    esac
    case $verb:$prev in
@VALUES@
    esac
    case $verb in
@CASES@
    esac
    COMPREPLY=()
    if ((COMP_CWORD == 1)); then
        words="@LIST@"
        files=@DECKS@
    fi
    if [[ $cur == -* ]]; then
        COMPREPLY=($(compgen -W "$options" -- "$cur"))
        return
    fi
    [[ -n $words ]] && COMPREPLY=($(compgen -W "$words" -- "$cur"))
    if [[ -n $files ]]; then
        local IFS=$'\\n'
        compopt -o filenames 2>/dev/null
        COMPREPLY+=($(compgen -d -- "$cur"))
        for suffix in ${files//:/$IFS}; do
            COMPREPLY+=($(compgen -f -X "!*.$suffix" -- "$cur"))
        done
    fi
}
complete -F _emsim emsim"""


def bash() -> Iterator[str]:
    cases, values = [], []
    for verb in VERBS:
        options = options_of(verb)
        names = " ".join(name for option in options for name in option.names)
        words = words_of(verb)
        what = f"files={':'.join(extensions_of(verb))}" if words is None else f'words="{" ".join(words)}"'
        cases.append(f'        {verb}) options="{names}" {what} ;;')
        for option in options:
            found = values_of(option)
            if found is None:
                continue
            pattern = "|".join(f"{verb}:{name}" for name in option.names)
            if found:
                reply = f'COMPREPLY=($(compgen -W "{" ".join(found)}" -- "$cur"))'
            elif option.value in FILES:
                reply = 'compopt -o filenames 2>/dev/null; COMPREPLY=($(compgen -f -- "$cur"))'
            else:
                reply = "COMPREPLY=()"
            values.append(f"        {pattern}) {reply}; return ;;")
    text = _BASH.replace("@VERBS@", "|".join(VERBS)).replace("@LIST@", " ".join(VERBS))
    text = text.replace("@DECKS@", ":".join(DECKS)).replace("@CASES@", "\n".join(cases))
    yield from text.replace("@VALUES@", "\n".join(values)).splitlines()


# ---- zsh ----------------------------------------------------------------------------------------


def zsh() -> Iterator[str]:
    yield "#compdef emsim"
    yield "# completion of emsim; written by `emsim completion zsh`"
    yield "_emsim() {"
    yield "    local verb=$words[2]"
    yield "    local -a verbs"
    yield "    verbs=("
    for verb, text in VERBS.items():
        yield f"        {_quoted(f'{verb}:{text}')}"
    yield "    )"
    yield "    if (( CURRENT == 2 )) && [[ $verb != -* ]]; then"
    yield "        _describe verb verbs"
    yield f"        _files -g {_quoted(_pattern(DECKS))}"
    yield "        return"
    yield "    fi"
    # options of the verb alone: the line without it
    yield "    if (( ${verbs[(I)$verb:*]} )); then"
    yield '        words=($words[1] "${(@)words[3,-1]}") && (( CURRENT -= 1 ))'
    yield "    else"
    yield "        verb=run"
    yield "    fi"
    yield "    case $verb in"
    for verb in VERBS:
        yield f"        {verb})"
        yield "            _arguments -s \\"
        for option in options_of(verb):
            yield f"                {_zsh_option(option)} \\"
        words = words_of(verb)
        if words is None:
            action = _quoted(f'*:file:_files -g "{_pattern(extensions_of(verb))}"')
        else:
            action = _quoted(f"1:word:({' '.join(words)})") if words else _quoted("*: :")
        yield f"                {action}"
        yield "            ;;"
    yield "    esac"
    yield "}"
    # as a function of fpath the file is the body of _emsim; sourced it only defines it
    yield 'if [[ $funcstack[1] == _emsim ]]; then _emsim "$@"; else compdef _emsim emsim; fi'


def _zsh_option(option: Option) -> str:
    value = ""
    if (found := values_of(option)) is not None:
        action = f"({' '.join(found)})" if found else "_files" if option.value in FILES else " "
        value = f":{_escaped(option.value)}:{action}"
    head = "*" if option.repeat else f"({' '.join(option.names)})"
    text = f"[{_escaped(option.help)}]{value}"
    if len(option.names) == 1:
        return _quoted(head.replace(f"({option.names[0]})", "") + option.names[0] + text)
    return f"{_quoted(head)}{{{','.join(option.names)}}}{_quoted(text)}"


def _pattern(extensions: tuple[str, ...]) -> str:
    return f"*.({'|'.join(extensions)})"


def _escaped(text: str) -> str:
    return "".join("\\" + c if c in "[]:\\" else c for c in text)


def _quoted(text: str) -> str:
    """A word in single quotes, for bash and zsh."""
    return "'" + text.replace("'", "'\\''") + "'"


# ---- fish ---------------------------------------------------------------------------------------

_FISH = """\
# completion of emsim; written by `emsim completion fish`
function __emsim_verb
    set -l words (commandline -opc)
    if test (count $words) -gt 1; and contains -- $words[2] @VERBS@
        echo $words[2]
    else
        echo run
    end
end
function __emsim_first
    test (count (commandline -opc)) -eq 1
end
function __emsim_files
    set -l word (commandline -ct)
    __fish_complete_directories $word
    for extension in $argv
        for file in $word*.$extension
            echo $file
        end
    end
end
complete -c emsim -f"""


def fish() -> Iterator[str]:
    yield from _FISH.replace("@VERBS@", " ".join(VERBS)).splitlines()
    for verb, text in VERBS.items():
        yield f"complete -c emsim -n __emsim_first -a {verb} -d {_fish(text)}"
    for verb in VERBS:
        here = f"complete -c emsim -n 'test (__emsim_verb) = {verb}'"
        words = words_of(verb)
        if words is None:
            yield f"{here} -a '(__emsim_files {' '.join(extensions_of(verb))})'"
        elif words:
            yield f"{here} -a '{' '.join(words)}'"
        for option in options_of(verb):
            line = here
            for name in option.names:
                line += f" -l {name[2:]}" if name.startswith("--") else f" -s {name[1:]}"
            if (found := values_of(option)) is not None:
                line += (
                    f" -x -a '{' '.join(found)}'" if found else " -r -F" if option.value in FILES else " -x"
                )
            yield f"{line} -d {_fish(option.help)}"


def _fish(text: str) -> str:
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"

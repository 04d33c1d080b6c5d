#!/bin/bash
# Finds functions with more than five parameters, and functions of more than 80 lines without a comment that says why
# (a line "// Over 80 lines because ..." directly before or inside). Those of before the rule stand in
# function_size_left.txt, which may only become shorter: a function that is not there fails, and so does a line without one.
#   [SOURCE_FOLDER]   --list prints what is found in the form of that file
# clang-tidy's readability-function-size knows neither lambdas nor functions that are only declared, nor a reason.
set -euo pipefail
list=0
if [ "${1-}" = --list ]; then list=1 && shift; fi
cd "${1:-$(dirname "$(readlink -f "$0")")/../..}"
find models identification diagnosis problems planners optimizer simulator apps bench studies examples tests \
  \( -name '*.h' -o -name '*.cpp' \) -type f | LC_ALL=C sort | LIST=$list perl -e '
use strict;
my ($most_parameters, $most_lines) = (5, 80);
my (%found, %where, $failed);
my $balanced = qr/(?<b>\((?:[^(){}\[\]]++|(?&any))*+\))(?(DEFINE)(?<any>\((?:[^(){}\[\]]++|(?&any))*+\)|\{(?:[^(){}\[\]]++|(?&any))*+\}|\[(?:[^(){}\[\]]++|(?&any))*+\]))/;
my $block = qr/(?<c>\{(?:[^{}]++|(?&c))*+\})/;
# What stands inside comments and literals is blanked; lines and columns stay.
sub blank { my $t = shift; $t =~ s/[^\n]/ /g; $t }
sub parameters {  # -> number of parameters, and how many of them look like "type name" and not like an expression
  my $list = shift;
  $list =~ s/^\(//; $list =~ s/\)$//;
  $list =~ s/->/  /g;
  1 while $list =~ s/(\(|\{|\[)[^(){}\[\]]*(\)|\}|\])/ /;
  1 while $list =~ s/(?<=\w)<[^<>]*>//;  # template arguments: clang-format puts no space before their bracket
  return (0, 0) if $list !~ /\S/;
  my @all = split /,/, $list, -1;
  my $typed = grep {
    s/=.*//s; s/^\s+|\s+$//g;
    /^(?:const\s+|struct\s+|unsigned\s+)*[A-Za-z_][\w:]*\s*(?:(?:const)?\s*[&*]+\s*\w*|\s+\w+)$/ && !/\w\s+[&*]\s+\w/
      && !/^(?:return|new|delete|throw|not)\b/
  } @all;
  return (scalar @all, $typed);
}
sub report {
  my ($kind, $count, $file, $line, $name) = @_;
  my $key = "$kind $file $name";
  return if ($found{$key} // 0) >= $count;
  $found{$key} = $count;
  $where{$key} = "$file:$line: $name has $count " . ($kind eq "parameters"
    ? "parameters, more than $most_parameters: let it take a struct (CONTRIBUTING.md, rule 9)"
    : "lines, more than $most_lines, and no comment \"// Over $most_lines lines because ...\"");
}
while (my $file = <STDIN>) {
  chomp $file;
  open(my $in, "<", $file) or die "$file: $!";
  my $text = do { local $/; <$in> };
  close $in;
  my @lines = split /\n/, $text, -1;
  $text =~ s{//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\g{-1}"|"(?:\\.|[^"\\\n])*"|(?<!\w)\x27(?:\\.|[^\x27\\\n])+\x27}{blank($&)}gse;
  $text =~ s{^[ \t]*#(?:[^\n]*\\\n)*[^\n]*}{blank($&)}gme;
  my ($at, $line) = (0, 1);
  while ($text =~ /(?<name>operator\s*(?:\(\)|[^\s\w(]+)|~?[A-Za-z_][\w:~]*|\])\s*(?=\()/g) {
    my ($name, $start, $open) = ($+{name}, $-[0], pos $text);
    $line += (substr($text, $at, $start - $at) =~ tr/\n//), $at = $start;
    next if $name =~ /^(?:if|for|while|switch|return|sizeof|catch|decltype|alignas|static_assert|noexcept|defined|[A-Z][A-Z0-9_]+)$/;
    $name = "lambda" if $name eq "]";
    next unless substr($text, $open) =~ /^$balanced/;
    my $list = $+{b};
    my $rest = substr($text, $open + length $list, 4000);
    next unless $rest =~ /^(?:\s*(?:const|noexcept|override|final|mutable|->\s*[\w:<>,&*\s]+?))*\s*(?<end>[{;:=])/;
    my ($end, $gap) = ($+{end}, $+[0]);
    my ($count, $typed) = parameters($list);
    next if $count > 0 && 2 * $typed < $count;
    next if $count == 0 && $end ne "{";
    report("parameters", $count, $file, $line, $name) if $count > $most_parameters;
    next unless $end eq "{" || $end eq ":";
    my $from = $open + length($list) + $gap - 1;
    if ($end eq ":") {  # a constructor: past its initialisers
      my $members = substr($text, $from + 1);
      next unless $members =~ /^(?:\s*[\w:]+(?:<[^;{}]*?>)?\s*(?:$balanced|$block)\s*,?)+\s*(?=\{)/;
      $from += 1 + $+[0];
    }
    next unless substr($text, $from) =~ /^$block/;
    my $length = ($+{c} =~ tr/\n//);
    next if $length <= $most_lines;
    my $first = $line - 1;
    $first-- while $first > 0 && $lines[$first - 1] =~ /^\s*(?:\/\/|template)/;
    next if join("\n", @lines[$first .. $line - 1 + $length]) =~ /\/\/\/? Over $most_lines lines because \w/;
    report("lines", $length, $file, $line, $name);
  }
}
if ($ENV{LIST}) { print "$_\n" for sort keys %found; exit 0 }
my $left = "tests/architecture/function_size_left.txt";
my %allowed;
if (open(my $in, "<", $left)) {
  while (<$in>) { s/#.*//; s/\s+$//; $allowed{$_} = 1 if /\S/ }
}
for my $key (sort keys %found) {
  next if $allowed{$key};
  print STDERR "$where{$key}\n";
  $failed = 1;
}
for my $key (sort keys %allowed) {
  next if $found{$key};
  print STDERR "$left: \"$key\" is mended or gone: remove the line\n";
  $failed = 1;
}
exit($failed ? 1 : 0);
'

//! SELECTs as people write them, in the form that Polars answers rightly.
//!
//! Polars names a column after the first one that its expression reads, so `MIN(x), MAX(x)` collide; it knows only names
//! in `ORDER BY` of groups; and it loses which table a column is from where it groups a join.

use sqlparser::ast::{
    Expr, GroupByExpr, Ident, OrderBy, OrderByExpr, OrderByKind, Query, Select, SelectItem, SetExpr, TableWithJoins,
    visit_expressions, visit_expressions_mut,
};
use sqlparser::dialect::GenericDialect;
use sqlparser::parser::Parser;
use std::ops::ControlFlow;

/// Functions of many rows that give one value, in lower case.
const AGGREGATES: [&str; 26] = [
    "array_agg",
    "avg",
    "corr",
    "count",
    "covar",
    "covar_pop",
    "covar_samp",
    "first",
    "group_concat",
    "last",
    "listagg",
    "max",
    "median",
    "min",
    "quantile_cont",
    "quantile_disc",
    "stddev",
    "stddev_samp",
    "stdev",
    "stdev_samp",
    "string_agg",
    "sum",
    "var",
    "var_samp",
    "variance",
    "mean",
];

/// Rewrites one query; those within it have been.
pub(super) fn rewrite(query: &mut Query) {
    name_columns(&mut query.body);
    let Query { body, order_by, .. } = &mut *query;
    let SetExpr::Select(select) = &mut **body else { return };
    let order = match order_by {
        Some(OrderBy { kind: OrderByKind::Expressions(order), .. }) => order.as_mut_slice(),
        _ => &mut [],
    };
    group_a_join(select, order);
    order_by_names(query);
}

fn name_columns(body: &mut SetExpr) {
    match body {
        SetExpr::Select(select) => name_items(&mut select.projection),
        SetExpr::SetOperation { left, right, .. } => {
            name_columns(left);
            name_columns(right);
        }
        _ => {}
    }
}

/// Gives each column a name: its own, or the text of its expression.
fn name_items(items: &mut [SelectItem]) {
    let mut names: Vec<String> = Vec::new();
    for item in &*items {
        match item {
            SelectItem::UnnamedExpr(Expr::Identifier(name)) | SelectItem::ExprWithAlias { alias: name, .. } => {
                names.push(name.value.clone());
            }
            _ => {}
        }
    }
    let mut seen_plain: Vec<String> = Vec::new();
    for item in items {
        let SelectItem::UnnamedExpr(expression) = item else { continue };
        let text = expression.to_string().replace('"', "");
        let wished = match expression {
            Expr::Identifier(name) if !seen_plain.contains(&name.value) => {
                seen_plain.push(name.value.clone());
                continue;
            }
            Expr::CompoundIdentifier(parts) => parts.last().map_or_else(String::new, |part| part.value.clone()),
            _ => text.clone(),
        };
        let wished = if names.contains(&wished) { text } else { wished };
        let numbered = (2_u32..).map(|number| format!("{wished} ({number})"));
        let name = std::iter::once(wished.clone()).chain(numbered).find(|name| !names.contains(name));
        let name = name.unwrap_or_default();
        names.push(name.clone());
        *item = SelectItem::ExprWithAlias { expr: expression.clone(), alias: quoted(&name) };
    }
}

fn quoted(name: &str) -> Ident {
    Ident::with_quote('"', name.replace('"', "'"))
}

/// Where a join is grouped, selects the columns that are asked of it under plain names first.
fn group_a_join(select: &mut Select, order: &mut [OrderByExpr]) {
    let is_join = |from: &[TableWithJoins]| from.len() > 1 || from.iter().any(|table| !table.joins.is_empty());
    if !is_join(&select.from) || !is_grouped(select) || !is_plain(select) {
        return;
    }
    let aliases: Vec<String> = select.projection.iter().filter_map(alias).map(|alias| alias.value.clone()).collect();
    let mut columns: Vec<String> = Vec::new();
    let mut take = |expression: &mut Expr, knows_aliases: bool| {
        let _: ControlFlow<()> = visit_expressions_mut(expression, |part| {
            let is_column = match part {
                Expr::Identifier(name) => !(knows_aliases && aliases.contains(&name.value)),
                Expr::CompoundIdentifier(_) => true,
                _ => false,
            };
            if is_column {
                let text = part.to_string();
                let position = columns.iter().position(|column| *column == text).unwrap_or_else(|| {
                    columns.push(text);
                    columns.len() - 1
                });
                *part = Expr::Identifier(quoted(&format!("column {}", position + 1)));
            }
            ControlFlow::Continue(())
        });
    };
    let mut grouped = select.clone();
    grouped.projection.iter_mut().filter_map(expression_mut).for_each(|expression| take(expression, false));
    if let GroupByExpr::Expressions(expressions, _) = &mut grouped.group_by {
        expressions.iter_mut().for_each(|expression| take(expression, true));
    }
    grouped.having.iter_mut().for_each(|expression| take(expression, true));
    let mut ordered = order.to_vec();
    ordered.iter_mut().for_each(|by| take(&mut by.expr, true));
    if columns.is_empty() {
        return;
    }
    let columns = columns.iter().zip(1..).map(|(text, number)| format!("{text} AS \"column {number}\""));
    let from = select.from.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let filter = select.selection.as_ref().map_or_else(String::new, |filter| format!(" WHERE {filter}"));
    let inner = format!("SELECT {} FROM {from}{filter}", columns.collect::<Vec<_>>().join(", "));
    let Some(from) = derived(&inner, "joined") else { return };
    *select = Select { from, selection: None, ..grouped };
    order.clone_from_slice(&ordered);
}

/// Orders by the names of columns, also of such as are not selected.
fn order_by_names(query: &mut Query) {
    let SetExpr::Select(select) = &mut *query.body else { return };
    let Some(OrderBy { kind: OrderByKind::Expressions(order), .. }) = &mut query.order_by else { return };
    for by in order.iter_mut() {
        let text = by.expr.to_string().to_lowercase();
        let is_selected = |item: &&SelectItem| expression(item).is_some_and(|of| of.to_string().to_lowercase() == text);
        if let Some(alias) = select.projection.iter().find(is_selected).and_then(alias) {
            by.expr = Expr::Identifier(alias.clone());
        }
    }
    let is_aside = |by: &OrderByExpr| has_aggregate(&by.expr);
    if !is_grouped(select) || !is_plain(select) || !order.iter().any(is_aside) {
        return;
    }
    let selected: Vec<Ident> = select.projection.iter().filter_map(name).cloned().collect();
    let mut ordered = order.clone();
    let mut inner = select.clone();
    for (by, number) in ordered.iter_mut().zip(1..) {
        if !matches!(&by.expr, Expr::Value(_)) && !is_name_of(&by.expr, &selected) {
            let alias = quoted(&format!("order {number}"));
            let expr = std::mem::replace(&mut by.expr, Expr::Identifier(alias.clone()));
            inner.projection.push(SelectItem::ExprWithAlias { expr, alias });
        }
    }
    let names = selected.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let Some(outer) = select_from(&format!("SELECT {names} FROM ({inner}) AS \"grouped\"")) else { return };
    *order = ordered;
    *query.body = SetExpr::Select(Box::new(outer));
}

fn is_name_of(expression: &Expr, names: &[Ident]) -> bool {
    matches!(expression, Expr::Identifier(name) if names.iter().any(|of| of.value == name.value))
}

/// Whether rows are put together.
fn is_grouped(select: &Select) -> bool {
    has_keys(select) || select.projection.iter().filter_map(expression).any(has_aggregate)
}

/// Whether rows are put together by what they have in common.
fn has_keys(select: &Select) -> bool {
    match &select.group_by {
        GroupByExpr::All(_) => true,
        GroupByExpr::Expressions(expressions, _) => !expressions.is_empty(),
    }
}

/// Whether a SELECT has nothing but names and expressions of its own tables, so that it can be taken apart.
fn is_plain(select: &Select) -> bool {
    let items = select.projection.iter().map(expression);
    let has_no_others = select.distinct.is_none() && select.qualify.is_none() && select.named_window.is_empty();
    let is_by_all = matches!(select.group_by, GroupByExpr::All(_));
    let of_own = items.chain([select.having.as_ref()].into_iter().filter(Option::is_some));
    has_no_others && !is_by_all && of_own.into_iter().all(|item| item.is_some_and(|item| !has_subquery(item)))
}

fn has_subquery(expression: &Expr) -> bool {
    any(expression, |part| matches!(part, Expr::Subquery(_) | Expr::InSubquery { .. } | Expr::Exists { .. }))
}

/// A column that a select without groups asks for beside aggregates, which are of all rows.
pub(super) fn column_beside_aggregates(select: &Select) -> Option<String> {
    if has_keys(select) || !select.projection.iter().filter_map(expression).any(has_aggregate) {
        return None;
    }
    let is_column = |part: &Expr| matches!(part, Expr::Identifier(_) | Expr::CompoundIdentifier(_));
    select.projection.iter().find_map(|item| match expression(item) {
        Some(expression) if !has_aggregate(expression) && any(expression, is_column) => Some(expression.to_string()),
        Some(_) => None,
        None => Some(item.to_string()),
    })
}

fn has_aggregate(expression: &Expr) -> bool {
    any(expression, |part| match part {
        Expr::Function(function) if function.over.is_none() => {
            AGGREGATES.contains(&function.name.to_string().to_lowercase().as_str())
        }
        _ => false,
    })
}

fn any(expression: &Expr, is_found: impl Fn(&Expr) -> bool) -> bool {
    let found = visit_expressions(expression, |part| match is_found(part) {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    });
    found.is_break()
}

/// A query as a table.
fn derived(sql: &str, alias: &str) -> Option<Vec<TableWithJoins>> {
    Some(select_from(&format!("SELECT * FROM ({sql}) AS \"{alias}\""))?.from)
}

/// What was written from parts that had been parsed is parsed again.
fn select_from(sql: &str) -> Option<Select> {
    let query = Parser::new(&GenericDialect).try_with_sql(sql).and_then(|mut parser| parser.parse_query()).ok()?;
    match *query.body {
        SetExpr::Select(select) => Some(*select),
        _ => None,
    }
}

fn expression(item: &SelectItem) -> Option<&Expr> {
    match item {
        SelectItem::UnnamedExpr(expression) | SelectItem::ExprWithAlias { expr: expression, .. } => Some(expression),
        _ => None,
    }
}

fn expression_mut(item: &mut SelectItem) -> Option<&mut Expr> {
    match item {
        SelectItem::UnnamedExpr(expression) | SelectItem::ExprWithAlias { expr: expression, .. } => Some(expression),
        _ => None,
    }
}

fn alias(item: &SelectItem) -> Option<&Ident> {
    match item {
        SelectItem::ExprWithAlias { alias, .. } => Some(alias),
        _ => None,
    }
}

/// The name that a column comes out under.
fn name(item: &SelectItem) -> Option<&Ident> {
    match item {
        SelectItem::UnnamedExpr(Expr::Identifier(name)) | SelectItem::ExprWithAlias { alias: name, .. } => Some(name),
        _ => None,
    }
}
